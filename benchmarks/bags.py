"""Reading speed of ROS bags and TDMS files beside their libraries alone, in one run.

``python benchmarks/bags.py [FOLDER]``: FOLDER holds the third-party logs (default ../shared/data);
what is absent there is passed over. A ROS 2 bag and a larger TDMS file are made on the spot. The
library alone unpacks every message, or reads every channel and one time
track; the reader gives columns. The best of several turns counts.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.logs.rosbag import RosBagReader
from rftfit.logs.tdms import TdmsReader

if TYPE_CHECKING:
    from collections.abc import Callable

REPEATS = 9


def best(function: Callable[[], object]) -> float:
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def library_ros1(path: Path) -> None:
    from rosbags.rosbag1 import Reader
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    with Reader(path) as bag:
        store = get_typestore(Stores.EMPTY)
        for connection in bag.connections:
            store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        for connection, _, raw in bag.messages():
            store.deserialize_ros1(raw, connection.msgtype)


def library_ros2(path: Path) -> None:
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore

    with Reader(path) as bag:
        store = get_typestore(Stores.LATEST)
        for connection, _, raw in bag.messages():
            store.deserialize_cdr(raw, connection.msgtype)


def library_tdms(path: Path) -> None:
    import nptdms

    with path.open("rb") as file:
        content = nptdms.TdmsFile.read(file)
    for group in content.groups():
        for channel in group.channels():
            channel[:]
        group.channels()[0].time_track()


def make_ros2(folder: Path) -> Path:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.LATEST)
    types: Any = store.types
    kind = "geometry_msgs/msg/WrenchStamped"
    vector = types["geometry_msgs/msg/Vector3"](x=1.0, y=2.0, z=3.0)
    with Writer(folder / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        connection = bag.add_connection("/wrench", kind, typestore=store)
        for index in range(20000):
            stamp = types["builtin_interfaces/msg/Time"](sec=1 + index // 1000, nanosec=index)
            header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="sensor")
            wrench = types["geometry_msgs/msg/Wrench"](force=vector, torque=vector)
            message = types[kind](header=header, wrench=wrench)
            bag.write(connection, 10**9 + index * 10**6, store.serialize_cdr(message, kind))
    return next((folder / "bag").glob("*.mcap"))


def make_tdms(folder: Path) -> Path:
    from nptdms import ChannelObject, TdmsWriter

    path = folder / "made.tdms"
    with TdmsWriter(path) as writer:
        for start in range(20):
            values = np.arange(start * 10_000, (start + 1) * 10_000) / 7
            writer.write_segment(
                [
                    ChannelObject(
                        "rig", name, values, {"wf_start_offset": 0.0, "wf_increment": 0.01}
                    )
                    for name in "ABCDEF"
                ]
            )
    return path


def main() -> None:
    data_folder = (
        Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[2] / "shared/data"
    )
    bag, tdms = RosBagReader(), TdmsReader()
    with tempfile.TemporaryDirectory() as folder:
        cases: list[tuple[str, Path, Callable[[Path], object], Callable[[Path], object]]] = [
            (
                "ROS 1, rokubimini_msgs/Reading",
                data_folder / "cmu-sand/force-displacement_7.bag",
                library_ros1,
                bag.load,
            ),
            (
                "ROS 1, WrenchStamped",
                data_folder / "logs/ros1/ur3_wrench.bag",
                library_ros1,
                bag.load,
            ),
            ("ROS 2 (mcap), WrenchStamped", make_ros2(Path(folder)), library_ros2, bag.load),
            ("TDMS, 35 kB", data_folder / "logs/tdms/raw1.tdms", library_tdms, tdms.load),
            ("TDMS, made", make_tdms(Path(folder)), library_tdms, tdms.load),
        ]
        print("| file | MB | library alone, MB/s | reader, MB/s | reader / library, time |")
        print("|---|---|---|---|---|")
        for name, path, alone, reader in cases:
            if not path.is_file():
                print(f"| {name} | absent | | | |")
                continue
            size = path.stat().st_size / 1e6
            bare, ours = best(lambda f=alone, p=path: f(p)), best(lambda f=reader, p=path: f(p))  # type: ignore[misc]
            print(
                f"| {name} | {size:.2f} | {size / bare:.1f} | {size / ours:.1f} | {ours / bare:.2f} |"
            )


if __name__ == "__main__":
    main()
