"""A config file is read as written, and every fault in it is named by its line and key."""

import re

import pytest

from rftfit.campaign.load import check_campaign

from .conftest import cases_of


def test_missing_a_folder_and_too_large(room, tmp_path):
    campaign, (problem,) = check_campaign(tmp_path / "config.yaml")
    assert (campaign, problem.code) == (None, "config.missing")
    assert problem.place.file == (tmp_path / "config.yaml").as_posix()
    (tmp_path / "a.yaml").mkdir()
    assert check_campaign(tmp_path / "a.yaml")[1][0].code == "config.not-a-file"
    room.config = "#" * 1_000_001
    assert re.search(" 1.0 MB .* 1 MB ", str(room.only("config.too-large")))


@pytest.mark.parametrize(("old", "new", "code", "line", "key", "value"), cases_of("config_faults"))
def test_each_fault_has_its_place(room, old, new, code, line, key, value):
    room.config = room.config.replace(old, new, 1)
    (problem,) = (problem for problem in room.check() if problem.code == f"config.{code}")
    place = problem.place
    assert (place.file, place.line or 0) == ("config/config.yaml", line)
    assert (place.key or place.column or "") == key
    assert value in str(problem)


@pytest.mark.parametrize("sign", [*"\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"])
def test_a_title_reads_as_it_is_written(room, sign):
    """Signs that turn the order of letters show another title than the file has."""
    room.config = room.config.replace("title: Test", f"title: Test {sign}tseT")
    problem = room.only("config.control")
    assert problem.place.line == 1
    assert str(problem).isprintable()


def test_all_faults_at_once(room):
    room.config = room.config.replace("title:", "titel:", 1).replace("24", "x").replace("F3", "F5")
    codes = sorted(
        problem.code[7:] for problem in room.check() if problem.code.startswith("config.")
    )
    assert codes == ["missing-key", "out-of-range", "unknown-key", "wrong-type"]


def test_raw_may_be_a_link_to_another_disk_and_nothing_else_may(room, tmp_path_factory):
    room.write()
    elsewhere = tmp_path_factory.mktemp("elsewhere") / "raw"
    (room.folder / "raw").rename(elsewhere)
    (room.folder / "raw").symlink_to(elsewhere)
    campaign, problems = check_campaign(room.path)
    assert campaign is not None
    assert (problems, campaign.raw) == ([], room.folder / "raw")
    (room.folder / "far.csv").symlink_to(elsewhere.parent / "far.csv")
    (elsewhere.parent / "far.csv").write_text(room.text(), "utf-8")
    room.config = room.config.replace("run_sheet: runs.csv", "run_sheet: far.csv")
    assert room.only("config.path-outside").place.key == "run_sheet"


def test_encodings_and_line_ends(room):
    """A byte order mark and other line ends do not matter; other letters than those of UTF-8 are named."""
    room.write()
    content = room.path.read_bytes()
    room.path.write_bytes(b"\xef\xbb\xbf" + content.replace(b"\n", b"\r\n"))
    assert check_campaign(room.path)[1] == []
    room.path.write_bytes(content.replace(b"Test", "Körner".encode("latin-1")))
    problem = check_campaign(room.path)[1][0]
    assert (problem.code, problem.place.line, problem.found) == ("config.not-utf8", 1, "byte 0xf6")


@pytest.mark.parametrize(
    ("code", "texts"),
    [
        ("empty", ["", "# nothing\n", "---\n", "~"]),
        ("wrong-type", ["3", "[1, 2]", "word"]),
        ("too-large", ["[" * 100_000, "{a: " * 50_000, "- " * 50_000, f"[{'a,' * 20_000}]"]),
        ("too-large", ["a:\n" + "".join(f" k{i}: 1\n" for i in range(20_000))]),
    ],
)
def test_a_config_without_a_section_or_with_too_many(room, texts, code):
    for room.config in texts:
        problem = room.only(f"config.{code}")
        assert problem.place.file == "config/config.yaml"
        assert code != "too-large" or "16" in problem.allowed


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("010", 10),
        ("1e-3", 0.001),
        ("-.5", -0.5),
        ("1:30", "1:30"),
        ("no", "no"),
        ("True", True),
        ("2024-05-02", "2024-05-02"),
        ("1_000", "1_000"),
        ("'5'", "5"),
    ],
)
def test_numbers_and_words_are_what_they_look_like(room, text, value):
    room.config += f"force_log: {{dialect: tdms, options: {{2013: {text}, no: {text}}}}}\n"
    options = room.campaign().config.force_log.options
    assert options == {"2013": value, "no": value}
    assert type(options["no"]) is type(value)
