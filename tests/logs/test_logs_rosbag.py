"""ROS bags: the real ones, those of ROS 2, several topics, and every way in which one can be cut."""

import builtins
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rftfit.logs.base import LogError
from rftfit.logs.rosbag import RosBagReader
from rftfit.logs.rostopic import RostopicReader

pytest.importorskip("rosbags")

DATA = Path(__file__).parents[3] / "shared" / "data"
UR3 = DATA / "logs" / "ros1" / "ur3_wrench.bag"
CMU = DATA / "cmu-sand" / "force-displacement_1.bag"
needs_ur3 = pytest.mark.skipif(not UR3.is_file(), reason="ros1 bags of ../shared/data are absent")
needs_cmu = pytest.mark.skipif(not CMU.is_file(), reason="cmu-sand of ../shared/data is absent")


@pytest.fixture(scope="module")
def store():
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_HUMBLE)


def wrench(store, index, frame="sensor"):
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](
        sec=100 + index // 100, nanosec=index % 100 * 10**7
    )
    vector = types["geometry_msgs/msg/Vector3"]
    return types["geometry_msgs/msg/WrenchStamped"](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame),
        wrench=types["geometry_msgs/msg/Wrench"](
            force=vector(x=1.0 * index, y=-2.0, z=0.5), torque=vector(x=0.1, y=0.2, z=0.3 * index)
        ),
    )


def joints(store, index):
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=200, nanosec=index * 10**6)
    return types["sensor_msgs/msg/JointState"](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id=""),
        name=["shoulder", "elbow"],
        position=np.array([0.1 * index, 1.5]),
        velocity=np.array([]),
        effort=np.array([0.0, 9.0]),
    )


def write_ros2(path, store, plugin, messages):
    from rosbags.rosbag2 import StoragePlugin, Writer

    storage = StoragePlugin.MCAP if plugin == "mcap" else StoragePlugin.SQLITE3
    with Writer(path, version=9, storage_plugin=storage) as bag:
        found = {
            topic: bag.add_connection(topic, kind, typestore=store)
            for topic, kind in dict.fromkeys((topic, kind) for topic, kind, _ in messages)
        }
        for index, (topic, kind, message) in enumerate(messages):
            raw = store.serialize_cdr(message, kind)
            bag.write(found[topic], 5 * 10**9 + index * 10**7, raw)
    return next(path.glob("*.mcap" if plugin == "mcap" else "*.db3"))


WRENCH, JOINTS = "geometry_msgs/msg/WrenchStamped", "sensor_msgs/msg/JointState"


@needs_ur3
def test_a_wrench_at_125_hertz():
    log = RosBagReader().load(UR3)
    assert log.rows == log.size == 7718
    assert not log.dropped
    assert not log.missing
    assert log.columns["wrench.force.x"][0] == pytest.approx(-10.9139482582, abs=1e-9)
    assert log.units["wrench.force.x"] == "N"
    assert log.units["wrench.torque.z"] == "N m"
    assert np.median(np.diff(log.columns["time"])) == pytest.approx(0.008, abs=1e-4)
    assert "header.stamp" in log.notes[0]


@needs_ur3
@pytest.mark.parametrize("name", ["ur3_wrench", "ur3_wrench_noforces"])
def test_bag_and_csv_of_one_recording_are_identical(name):

    bag = RosBagReader().load(UR3.with_name(f"{name}.bag"))
    text = RostopicReader().load(UR3.with_name(f"{name}.csv"))
    shared = set(bag.columns) & set(text.columns)
    assert {"time", "received", "header.seq", "wrench.force.z", "wrench.torque.x"} <= shared
    assert set(bag.columns) == set(text.columns)
    for column in shared:
        # rostopic prints twelve digits
        np.testing.assert_allclose(
            bag.columns[column], text.columns[column], rtol=2e-11, err_msg=column
        )
    np.testing.assert_array_equal(bag.columns["time"], text.columns["time"])


@needs_cmu
def test_a_type_that_only_the_bag_knows():
    log = RosBagReader().load(CMU)
    assert log.size == 3004
    assert log.columns["wrench.wrench.force.z"].min() == pytest.approx(-186.54096985)
    assert log.units["wrench.wrench.force.z"] == "N"
    assert not log.columns["isForceTorqueSaturated"].any()
    assert np.ptp(log.columns["temperature"]) < 5


@needs_cmu
def test_as_the_library_reads_it():
    from rosbags.rosbag1 import Reader
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    log = RosBagReader().load(CMU)
    with Reader(CMU) as bag:
        store = get_typestore(Stores.EMPTY)
        connection = bag.connections[0]
        store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        for index, (_, _, raw) in enumerate(bag.messages()):
            if index % 500:
                continue
            message: Any = store.deserialize_ros1(raw, connection.msgtype)
            assert message.wrench.wrench.torque.y == log.columns["wrench.wrench.torque.y"][index]
            assert message.temperature == pytest.approx(log.columns["temperature"][index], abs=0)
            assert (
                message.imu.linear_acceleration.z
                == (log.columns["imu.linear_acceleration.z"][index])
            )


@pytest.mark.parametrize("plugin", ["mcap", "sqlite"])
def test_wrenches_of_ros2(tmp_path, store, plugin):
    messages = [("/wrench", WRENCH, wrench(store, index)) for index in range(120)]
    path = write_ros2(tmp_path / "bag", store, plugin, messages)
    reader = RosBagReader()
    assert reader.detect(path.read_bytes()[:65536])
    log = reader.load(path)
    np.testing.assert_array_equal(log.columns["wrench.force.x"], np.arange(120.0))
    np.testing.assert_allclose(log.columns["wrench.torque.z"], 0.3 * np.arange(120))
    np.testing.assert_allclose(log.columns["time"], 100 + np.arange(120) / 100, atol=1e-6)
    np.testing.assert_allclose(log.columns["received"], 5 + np.arange(120) / 100)


def test_joint_states_and_texts_of_other_lengths(tmp_path, store):
    messages = [("/joint_states", JOINTS, joints(store, index)) for index in range(10)]
    log = RosBagReader().load(write_ros2(tmp_path / "a", store, "mcap", messages))
    np.testing.assert_allclose(log.columns["position0"], 0.1 * np.arange(10))
    np.testing.assert_allclose(log.columns["effort1"], 9.0)
    # a frame's name that grows moves every number behind it
    frames = [("/wrench", WRENCH, wrench(store, index, "f" * (index % 3))) for index in range(30)]
    log = RosBagReader().load(write_ros2(tmp_path / "b", store, "sqlite", frames))
    np.testing.assert_array_equal(log.columns["wrench.force.x"], np.arange(30.0))


@pytest.mark.parametrize("mode", ["NONE", "FILE", "MESSAGE"])
def test_a_folder_of_ros2(tmp_path, store, mode):
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

    bag = Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.SQLITE3)
    if mode != "NONE":
        bag.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
    with bag:
        topic = bag.add_connection("/wrench", WRENCH, typestore=store)
        for index in range(50):
            bag.write(topic, index * 10**7, store.serialize_cdr(wrench(store, index), WRENCH))
    path = tmp_path / "bag" / "metadata.yaml"
    assert RosBagReader().detect(path.read_bytes())
    log = RosBagReader().load(path)
    np.testing.assert_array_equal(log.columns["wrench.force.x"], np.arange(50.0))
    if mode == "MESSAGE":
        with pytest.raises(LogError, match="name the folder"):
            RosBagReader().load(next(path.parent.glob("*.db3")))


def test_a_folder_of_several_files(tmp_path, store):
    import yaml

    parts = []
    for part in range(2):
        messages = [("/wrench", WRENCH, wrench(store, i)) for i in range(part * 30, part * 30 + 30)]
        path = write_ros2(tmp_path / f"part{part}", store, "sqlite", messages)
        parts.append(yaml.safe_load((path.parent / "metadata.yaml").read_text()))
        (tmp_path / "bag").mkdir(exist_ok=True)
        path.rename(tmp_path / "bag" / f"bag_{part}.db3")
    whole = parts[0]["rosbag2_bagfile_information"]
    other = parts[1]["rosbag2_bagfile_information"]["files"][0] | {"path": "bag_1.db3"}
    whole["files"] = [whole["files"][0] | {"path": "bag_0.db3"}, other]
    whole["relative_file_paths"] = ["bag_0.db3", "bag_1.db3"]
    for counted in (whole, whole["topics_with_message_count"][0]):
        counted["message_count"] = 60
    (tmp_path / "bag" / "metadata.yaml").write_text(yaml.safe_dump(parts[0]))
    log = RosBagReader().load(tmp_path / "bag" / "metadata.yaml")
    assert sorted(log.columns["wrench.force.x"]) == list(range(60))


def test_numbers_with_the_most_significant_byte_first(tmp_path, store):
    from rosbags.rosbag2 import StoragePlugin, Writer

    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        topic = bag.add_connection("/wrench", WRENCH, typestore=store)
        for index in range(50):
            # one recording may hold both: each message says its own order
            raw = store.serialize_cdr(wrench(store, index), WRENCH, little_endian=index % 2 == 0)
            bag.write(topic, index * 10**7, raw)
    log = RosBagReader().load(next((tmp_path / "bag").glob("*.mcap")))
    np.testing.assert_array_equal(log.columns["wrench.force.x"], np.arange(50.0))
    np.testing.assert_allclose(log.columns["time"], 100 + np.arange(50) / 100, atol=1e-6)


def test_several_topics(tmp_path, store):
    messages: list[tuple[str, str, Any]] = [("/left", WRENCH, wrench(store, 1))]
    messages += [("/right", WRENCH, wrench(store, 7))]
    path = write_ros2(tmp_path / "bag", store, "mcap", messages)
    with pytest.raises(LogError, match=r"several topics could be meant.*/left.*/right"):
        RosBagReader().load(path)
    log = RosBagReader().with_options({"topic": "/right"}).load(path)
    assert log.columns["wrench.force.x"].tolist() == [7.0]
    with pytest.raises(LogError, match="no topic '/middle'"):
        RosBagReader().with_options({"topic": "/middle"}).load(path)
    with pytest.raises(ValueError, match="allowed: topic"):
        RosBagReader().with_options({"topics": "/right"})


def test_packets_that_a_counter_misses(tmp_path):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    types: Any = store.types
    vector = types["geometry_msgs/msg/Vector3"](x=1.0, y=2.0, z=3.0)
    with Writer(tmp_path / "a.bag") as bag:
        connection = bag.add_connection("/wrench", WRENCH, typestore=store)
        for number in (1, 2, 3, 7, 8, 10):
            stamp = types["builtin_interfaces/msg/Time"](sec=number, nanosec=0)
            header = types["std_msgs/msg/Header"](seq=number, stamp=stamp, frame_id="")
            force = types["geometry_msgs/msg/Wrench"](force=vector, torque=vector)
            message = types[WRENCH](header=header, wrench=force)
            bag.write(connection, number * 10**9, store.serialize_ros1(message, WRENCH))
    log = RosBagReader().load(tmp_path / "a.bag")
    assert log.size == 6
    assert log.missing == {"lost packets (gap in header.seq)": 4}
    # a lost packet is a gap, not a shifted clock
    assert log.columns["time"].tolist() == [1, 2, 3, 7, 8, 10]


@cache
def short_bag():
    path = UR3.with_name("ur3_wrench_noforces.bag")
    return path.read_bytes(), RosBagReader().load(path)


@needs_ur3
@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(share=st.floats(0, 1))
def test_cut_anywhere(tmp_path, share):
    content, whole = short_bag()
    path = tmp_path / "cut.bag"
    length = int(share * (len(content) - 1))
    path.write_bytes(content[:length])
    try:
        log = RosBagReader().load(path)
    except LogError as error:
        told = str(error)
        assert length < 20000  # before the first message
        assert str(path) in told
        return
    assert log.dropped == {"cut in mid-message": 1}
    assert log.rows == log.size + 1
    for name, values in log.columns.items():
        np.testing.assert_array_equal(values, whole.columns[name][: log.size])
    # what stands before the cut comes back
    assert log.size >= whole.size * length / len(content) - 200


@pytest.mark.parametrize(
    "content", [b"", b"#ROSBAG V2.0\n", b"#ROSBAG V2.0\n" + bytes(500), b"\x89MCAP0\r\n", b"abc"]
)
def test_no_bag(tmp_path, content):
    path = tmp_path / "a.bag"
    path.write_bytes(content)
    with pytest.raises(LogError, match=r"a\.bag"):
        RosBagReader().load(path)
    with pytest.raises(LogError, match="missing"):
        RosBagReader().load(tmp_path / "b.bag")


def test_without_the_library(tmp_path, monkeypatch):
    real = builtins.__import__

    def absent(name, *args, **kwargs):
        if name.startswith("rosbags"):
            raise ImportError(name)
        return real(name, *args, **kwargs)

    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V2.0\n")
    monkeypatch.setattr(builtins, "__import__", absent)
    with pytest.raises(LogError, match=r"pip install .rftfit\[ros\]"):
        RosBagReader().load(tmp_path / "a.bag")


@pytest.mark.parametrize("plugin", ["mcap"])
def test_messages_that_do_not_fit(tmp_path, store, plugin):
    from rosbags.rosbag2 import StoragePlugin, Writer

    def write(name, raws):
        with Writer(tmp_path / name, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
            topic = bag.add_connection("/wrench", WRENCH, typestore=store)
            for index, raw in enumerate(raws):
                bag.write(topic, 5 * 10**9 + index, raw)
        return next((tmp_path / name).glob(f"*.{plugin}"))

    good = bytes(store.serialize_cdr(wrench(store, 1), WRENCH))
    with pytest.raises(LogError, match="no message on the topic /wrench"):
        RosBagReader().load(write("none", []))
    with pytest.raises(LogError, match="no message on /wrench fits its type"):
        RosBagReader().load(write("short", [good[:20]]))
    log = RosBagReader().load(write("one", [good, good[:20]]))
    assert log.dropped == {"message does not fit its type": 1}


def test_a_bag_without_the_definition_of_its_type(tmp_path, store, monkeypatch):
    import rosbags.typesys
    from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat
    from rosbags.rosbag2.storage_mcap import McapReader

    path = write_ros2(tmp_path / "bag", store, "mcap", [("/wrench", WRENCH, wrench(store, 1))])
    empty = MessageDefinition(MessageDefinitionFormat.NONE, "")
    read = McapReader.open

    def without(bag):
        read(bag)
        bag.connections = [one._replace(msgdef=empty) for one in bag.connections]

    monkeypatch.setattr(McapReader, "open", without)
    stores = rosbags.typesys.Stores
    get = rosbags.typesys.get_typestore
    monkeypatch.setattr(rosbags.typesys, "get_typestore", lambda _: get(stores.EMPTY))
    with pytest.raises(LogError, match=f"does not bring the definition of {WRENCH}, and it is no"):
        RosBagReader().load(path)


@pytest.mark.parametrize(
    ("definition", "said"),
    [
        ("float64[ x", r"the definition of lab/msg/Force in the bag is not readable"),
        ("lab/Gone x", r"no message on /force fits its type"),
        ("lab/Force itself", r"no message on /force fits its type"),
    ],
)
def test_a_definition_that_cannot_be_read(tmp_path, definition, said):
    from rosbags.rosbag1 import Writer

    with Writer(tmp_path / "a.bag") as bag:
        topic = bag.add_connection("/force", "lab/msg/Force", msgdef=definition, md5sum="0" * 32)
        bag.write(topic, 10**9, b"1234")
    with pytest.raises(LogError, match=said):
        RosBagReader().load(tmp_path / "a.bag")
