"""ROS 1 and ROS 2 bags are read topic by topic, and cut or hostile bags are counted or refused.

Bag: a log file of the robot operating system (ROS); topic: one series of messages in it.
"""

import time
from functools import cache
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from log_files import (
    MANY_WITHOUT_BYTES,
    NOTHING,
    WRENCH,
    refused,
    ros2_store,
    wrench,
    write_ros1,
    write_ros2,
)
from numpy.testing import assert_allclose, assert_array_equal
from seeds import example_count
from third_party import CMU_SAND, LOGS, needs

import rftfit
from rftfit.logs.registry import dialect

typesys = pytest.importorskip("rosbags.typesys")
rosbag1, rosbag2 = pytest.importorskip("rosbags.rosbag1"), pytest.importorskip("rosbags.rosbag2")

BAGS = dialect("ros-bag")
UR3 = LOGS / "ros1" / "ur3_wrench.bag"
CMU = CMU_SAND / "force-displacement_1.bag"
needs_ur3 = needs(UR3)
needs_cmu = needs(CMU)
TYPES = ros2_store().types
Time, Header = TYPES["builtin_interfaces/msg/Time"], TYPES["std_msgs/msg/Header"]
JOINTS = "sensor_msgs/msg/JointState"
LOST = "lost messages (gap in header.seq)"


@needs_ur3
@pytest.mark.parametrize("name", ["ur3_wrench", "ur3_wrench_noforces"])
def test_bag_and_csv_of_one_recording_are_identical(name):
    log = BAGS.load(UR3.with_name(f"{name}.bag"))
    text = dialect("rostopic").load(UR3.with_name(f"{name}.csv"))
    assert (log.units, log.dropped, log.missing) == (text.units, {}, {})
    assert (log.units["wrench.force.z"], log.units["wrench.torque.x"]) == ("N", "N m")
    assert {"time", "received", "header.seq"} <= set(log.columns)
    for column, values in log.columns.items():  # rostopic prints twelve digits
        assert_allclose(values, text.columns[column], rtol=2e-11, err_msg=column)
    assert_array_equal(log.columns["time"], text.columns["time"])


@needs_cmu
def test_a_type_that_only_the_bag_knows_as_the_library_reads_it():
    log = BAGS.load(CMU)
    assert log.size == 3004
    assert log.units["wrench.wrench.force.z"] == "N"
    assert log.columns["wrench.wrench.force.z"].min() == pytest.approx(-186.54096985)
    assert not log.columns["isForceTorqueSaturated"].any()
    with rosbag1.Reader(CMU) as bag:
        store = typesys.get_typestore(typesys.Stores.EMPTY)
        (connection,) = bag.connections
        kind = connection.msgtype
        store.register(typesys.get_types_from_msg(connection.msgdef.data, kind))
        for index, (_, _, raw) in enumerate(bag.messages()):
            if index % 500 == 0:
                message = store.deserialize_ros1(raw, kind)
                row = {name: values[index] for name, values in log.columns.items()}
                assert message.wrench.wrench.torque.y == row["wrench.wrench.torque.y"]
                assert message.temperature == row["temperature"]
                acceleration = message.imu.linear_acceleration.z
                assert acceleration == row["imu.linear_acceleration.z"]


@pytest.mark.parametrize(
    ("plugin", "endians"), [("MCAP", (True,)), ("SQLITE3", (True,)), ("MCAP", (True, False))]
)
def test_wrenches_of_ros2(tmp_path, plugin, endians):
    """One recording may hold messages of both orders of bytes: each says its own."""
    raws = [wrench(i, little_endian=endians[i % len(endians)]) for i in range(120)]
    path = write_ros2(tmp_path / "bag", raws, plugin)
    assert BAGS.detect(path.read_bytes()[:65536])
    columns = BAGS.load(path).columns
    assert_array_equal(columns["wrench.force.x"], np.arange(120.0))
    assert_allclose(columns["wrench.torque.z"], 0.3 * np.arange(120))
    assert_allclose(columns["time"], 100 + np.arange(120) / 100, atol=1e-6)
    assert_allclose(columns["received"], 5 + np.arange(120) / 100)


def test_joint_states_and_texts_of_other_lengths(tmp_path):
    raws = []
    for index in range(10):
        position, none, effort = (
            np.array(values) for values in ([0.1 * index, 1.5], [], [0.0, 9.0])
        )
        header, names = Header(Time(200, index * 10**6), ""), ["shoulder", "elbow"]
        message = TYPES[JOINTS](header, names, position, none, effort)
        raws.append(ros2_store().serialize_cdr(message, JOINTS))
    columns = BAGS.load(write_ros2(tmp_path / "a", raws, kind=JOINTS)).columns
    assert_allclose(columns["position0"], 0.1 * np.arange(10))
    assert_allclose(columns["effort1"], 9.0)
    # a frame's name that grows moves every number behind it
    raws = [wrench(index, "f" * (index % 3)) for index in range(30)]
    bag = write_ros2(tmp_path / "b", raws, "SQLITE3")
    log_of_all = BAGS.of_source({"header.frame_id": ("", "f", "ff")}).load(bag)
    assert_array_equal(log_of_all.columns["wrench.force.x"], np.arange(30.0))
    log_of_ff = BAGS.of_source({"header.frame_id": ("ff",)}).load(bag)
    assert_array_equal(log_of_ff.columns["wrench.force.x"], np.arange(2.0, 30, 3))
    assert [*log_of_ff.dropped.values()] == [20]
    # readings that go on are of one source, whatever it is called
    assert BAGS.load(bag).size == 30
    raws = [wrench(10 * (index % 2) + index, "fg"[index % 2]) for index in range(30)]
    mixed = write_ros2(tmp_path / "c", raws, "SQLITE3")
    refused(BAGS, mixed, "several-sources", "header.frame_id", "'f', 'g'")
    misnamed = BAGS.of_source({"header.frame": ("f",)})
    refused(misnamed, bag, "where", "'header.frame'", "did you mean 'header.frame_id'")


@pytest.mark.parametrize("mode", ["NONE", "FILE", "MESSAGE"])
def test_a_folder_of_ros2(tmp_path, mode):
    file = write_ros2(tmp_path / "bag", map(wrench, range(50)), "SQLITE3", mode=mode)
    path = tmp_path / "bag" / "metadata.yaml"
    assert BAGS.detect(path.read_bytes())
    log = BAGS.load(path)
    assert_array_equal(log.columns["wrench.force.x"], np.arange(50.0))
    if mode == "MESSAGE":
        assert refused(BAGS, file, "compressed").rows == 50


def test_a_folder_of_several_files(tmp_path):
    metadata = []
    (tmp_path / "bag").mkdir()
    for number in range(2):
        raws = map(wrench, range(number * 30, number * 30 + 30))
        path = write_ros2(tmp_path / f"part{number}", raws, "SQLITE3")
        metadata.append(yaml.safe_load((path.parent / "metadata.yaml").read_text()))
        path.rename(tmp_path / "bag" / f"bag_{number}.db3")
    bag_information, second_information = (
        file_metadata["rosbag2_bagfile_information"] for file_metadata in metadata
    )
    bag_information["relative_file_paths"] = ["bag_0.db3", "bag_1.db3"]
    bag_information["files"] = [
        entry["files"][0] | {"path": f"bag_{number}.db3"}
        for number, entry in enumerate((bag_information, second_information))
    ]
    for counted in (bag_information, bag_information["topics_with_message_count"][0]):
        counted["message_count"] = 60
    (tmp_path / "bag" / "metadata.yaml").write_text(yaml.safe_dump(metadata[0]))
    log = BAGS.load(tmp_path / "bag" / "metadata.yaml")
    assert sorted(log.columns["wrench.force.x"]) == list(range(60))


def test_several_topics(tmp_path):
    path = write_ros2(tmp_path / "bag", [wrench(1), wrench(7)], topics=("/left", "/right"))
    refused(BAGS, path, "topic", "{topic: ...}", "/left ", "/right ")
    log = BAGS.with_options({"topic": "/right"}).load(path)
    assert log.columns["wrench.force.x"].tolist() == [7.0]
    refused(BAGS.with_options({"topic": "/middle"}), path, "topic", "'/middle'")


@pytest.mark.parametrize(
    ("numbers", "missing"),
    [
        ([1, 2, 3, 7, 8, 10], {LOST: 4}),
        # a late message was not lost, and a counter begins anew after 2^32 - 1
        ([1, 2, 4, 3, 5], {}),
        ([2**32 - 2, 2**32 - 1, 0, 2], {LOST: 1}),
    ],
)
def test_packets_that_a_counter_misses(tmp_path, numbers, missing):
    store: Any = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    types = store.types
    vector = types["geometry_msgs/msg/Vector3"](1.0, 2.0, 3.0)
    force = types["geometry_msgs/msg/Wrench"](vector, vector)
    with rosbag1.Writer(tmp_path / "a.bag") as bag:
        connection = bag.add_connection("/wrench", WRENCH, typestore=store)
        for second, number in enumerate(numbers, start=1):
            stamp = types["builtin_interfaces/msg/Time"](second, 0)
            header = types["std_msgs/msg/Header"](seq=number, stamp=stamp, frame_id="")
            raw = store.serialize_ros1(types[WRENCH](header, force), WRENCH)
            bag.write(connection, second * 10**9, raw)
    log = BAGS.load(tmp_path / "a.bag")
    assert log.missing == missing
    # the time is the stamp, whatever the counter says
    assert log.columns["time"].tolist() == [*range(1, len(numbers) + 1)]


@cache
def short_bag():
    path = UR3.with_name("ur3_wrench_noforces.bag")
    return path.read_bytes(), BAGS.load(path)


@needs_ur3
@pytest.mark.statistics
@settings(
    max_examples=example_count(60), suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(share=st.floats(0, 1))
def test_cut_anywhere(tmp_path, share):
    content, whole_log = short_bag()
    path = tmp_path / "cut.bag"
    length = int(share * (len(content) - 1))
    path.write_bytes(content[:length])
    try:
        log = BAGS.load(path)
    except rftfit.RftfitError as error:
        message = str(error)
        assert length < 20000  # before the first message
        assert str(path) in message
        return
    assert [*log.dropped.values()] == [1]
    assert log.rows == log.size + 1
    for name, values in log.columns.items():
        assert_array_equal(values, whole_log.columns[name][: log.size])
    # what stands before the cut comes back
    assert log.size >= whole_log.size * length / len(content) - 200


def test_messages_that_do_not_fit(tmp_path):
    good = bytes(wrench(1))
    for raws, code in (([], "header_only"), ([good[:20]], "no_good_row")):
        error = refused(BAGS, write_ros2(tmp_path / code, raws), code, "/wrench")
        assert error.rows == len(raws)
    log = BAGS.load(write_ros2(tmp_path / "one", [good, good[:20]]))
    assert (log.size, [*log.dropped.values()]) == (1, [1])


DOUBLED = "lab/D0 x\n" + "".join(
    f"{'=' * 80}\nMSG: lab/D{level}\nlab/D{level + 1} a\nlab/D{level + 1} b\n"
    for level in range(40)
)
REFUSED = {
    "an array of a thousand million messages without bytes": (MANY_WITHOUT_BYTES, bytes(8)),
    "a list that says it has as many": (
        f"lab/Nothing[] x\nfloat64 y\n{NOTHING}",
        (10**9).to_bytes(4, "little") + bytes(8),
    ),
    "messages that hold two of the next, forty times": (
        f"float64 y\n{DOUBLED}{'=' * 80}\nMSG: lab/D40\n",
        bytes(8),
    ),
    "a type that is not there": ("lab/Gone x", b"1234"),
    "a type that holds itself": ("lab/Force itself", b"1234"),
}
"""Definition of a type and a message of it."""


@pytest.mark.parametrize("name", REFUSED)
def test_a_type_made_to_take_for_ever_is_refused_at_once(tmp_path, name):
    path = write_ros1(tmp_path / "a.bag", *REFUSED[name])
    begin = time.process_time()
    refused(BAGS, path, "no_good_row", "/force")
    assert time.process_time() - begin < 2


@pytest.mark.parametrize(
    "packed", [rosbag1.Writer.CompressionFormat.BZ2, rosbag1.Writer.CompressionFormat.LZ4]
)
def test_a_block_that_unpacks_to_any_size_is_refused(tmp_path, monkeypatch, packed):
    """A few kilobytes of zeros: with the limit as it is they would be 64 MB."""
    path = write_ros1(tmp_path / "a.bag", "uint8[] x", bytes(2 << 20), packed=packed)
    assert path.stat().st_size < 20_000
    monkeypatch.setattr("rftfit.logs.blocks.MOST_OF_BLOCK", 1 << 20)
    with pytest.raises(rftfit.RftfitError, match=r"a\.bag"):
        BAGS.load(path)


def test_units_are_those_that_ros_lays_down_for_a_type(tmp_path):
    """A field of the same name in a lab's own type has none."""
    vector = "geometry_msgs/Vector3"
    definition = "time stamp\ngeometry_msgs/Twist twist\nlab/Own own\n"
    for name, fields in (
        ("geometry_msgs/Twist", f"{vector} linear\n{vector} angular\n"),
        (vector, "float64 x\nfloat64 y\nfloat64 z\n"),
        ("lab/Own", f"{vector} angular\n"),
    ):
        definition += f"{'=' * 80}\nMSG: {name}\n{fields}"
    units = BAGS.load(write_ros1(tmp_path / "a.bag", definition, bytes(80))).units
    assert (units["time"], units["received"], units["stamp"]) == ("s", "s", "s")
    assert (units["twist.angular.y"], units["own.angular.y"]) == ("rad/s", "")


def mcap_of(folder, definition):
    """A bag of ROS 2 with one message of a lab's own type."""
    bag = rosbag2.Writer(folder, version=9, storage_plugin=rosbag2.StoragePlugin.MCAP)
    with bag:
        topic = bag.add_connection("/force", "lab/msg/Force", msgdef=definition, rihs01="0" * 64)
        bag.write(topic, 10**9, bytes(12))
    return next(folder.glob("*.mcap"))


def test_what_a_library_raises_is_a_reason_on_one_line(tmp_path):
    """A definition that does not parse: its text is the stranger's, and stays inside one line."""
    definition = "float64[ x\nimport os\n\x1b[31m"
    ros1 = write_ros1(tmp_path / "b.bag", definition, bytes(8))
    for path, code in ((mcap_of(tmp_path / "bag", definition), "damaged"), (ros1, "type")):
        message = str(refused(BAGS, path, code, "lab/msg/Force"))
        assert "\n" not in message
        assert "\x1b" not in message


def test_a_bag_without_the_definition_of_its_type(tmp_path, monkeypatch):
    from rosbags.interfaces import MessageDefinition, MessageDefinitionFormat
    from rosbags.rosbag2.storage_mcap import McapReader

    path = mcap_of(tmp_path / "bag", "float64 x\n")
    empty = MessageDefinition(MessageDefinitionFormat.NONE, "")
    read = McapReader.open

    def without(bag):
        read(bag)
        bag.connections = [connection._replace(msgdef=empty) for connection in bag.connections]

    monkeypatch.setattr(McapReader, "open", without)
    assert refused(BAGS, path, "type", "lab/msg/Force").rows == 1
