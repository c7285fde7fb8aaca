"""A config file is read as written, and every fault in it is named by its line and key."""

import re

import pytest

from rftfit.campaign.load import check_campaign


def test_missing_a_folder_and_too_large(room, tmp_path):
    campaign, (problem,) = check_campaign(tmp_path / "config.yaml")
    assert (campaign, problem.code) == (None, "config.missing")
    assert problem.place.file == (tmp_path / "config.yaml").as_posix()
    (tmp_path / "a.yaml").mkdir()
    assert check_campaign(tmp_path / "a.yaml")[1][0].code == "config.not-a-file"
    room.config = "#" * 1_000_001
    assert re.search(" 1.0 MB .* 1 MB ", str(room.only("config.too-large")))


@pytest.mark.parametrize(
    ("old", "new", "code", "line", "key", "value"),
    [
        ("title: Test", "title: a: b", "not-yaml", 1, "9", "not YAML"),
        ("title: Test", "title: \x01", "not-yaml", 1, None, ""),
        ("title: Test", "titel: Test", "unknown-key", 1, "titel", "'title'?"),
        ("title: Test", "titel: Test", "missing-key", None, "title", ""),
        ("  name: s", "  nam: s", "unknown-key", 5, "transducer.nam", "'name'?"),
        (
            "0.64}",
            "0.64, lenght_cm: 3}",
            "unknown-key",
            10,
            "intruders.plate.lenght_cm",
            "'length_cm'?",
        ),
        ("shape: plate", "shape: plat", "shape", 10, "intruders.plate.shape", "'plate'?"),
        (
            "width_cm: 22",
            "width_cm: -22",
            "out-of-range",
            8,
            "container.width_cm",
            "'-22'; allowed: a number above 0",
        ),
        ("width_cm: 22", "width_cm: .nan", "out-of-range", 8, "container.width_cm", "'nan'"),
        ("width_cm: 22", "width_cm: .inf", "out-of-range", 8, "container.width_cm", "'inf'"),
        (
            "width_cm: 22",
            f"width_cm: {'9' * 400}",
            "out-of-range",
            8,
            "container.width_cm",
            "'inf'",
        ),
        ("width_cm: 22", 'width_cm: "22"', "wrong-type", 8, "container.width_cm", "without quotes"),
        ("width_cm: 22", 'width_cm: "2,5"', "wrong-type", 8, "container.width_cm", "'2.5'?"),
        ("width_cm: 22", "width_cm: true", "wrong-type", 8, "container.width_cm", "found 'true'"),
        ("title: Test", "title: 2013", "wrong-type", 1, "title", "in quotes"),
        (
            "[65, 65, 200]",
            "[65, 200]",
            "wrong-type",
            6,
            "transducer.range_N",
            "'a list of 2'; allowed: 3 numbers",
        ),
        ("[65, 65, 200]", "[65, 65, 0]", "out-of-range", 6, "transducer.range_N.3", "3 numbers"),
        ('z: "-F3"', 'z: "-F4"', "out-of-range", 7, "transducer.axes.z", "+F1, -F1"),
        ('z: "-F3"', 'z: "+F2"', "inconsistent", 7, "transducer.axes", "found F2, F1, F2"),
        ("  poppy_CP:", "  poppy_lp:", "inconsistent", 14, "media", "'poppy_LP' and 'poppy_lp'"),
        ("  poppy_CP:", "  poppy CP:", "bad-name", 16, "media.poppy CP", "letters"),
        (
            '{title: "poppy seeds, close"}',
            "{title: x, role: sand}",
            "unknown-word",
            16,
            "media.poppy_CP.role",
            "laboratory",
        ),
        ("  poppy_CP:", "  poppy_LP:", "duplicate-key", 16, "media.poppy_LP", "line 15"),
        ("raw: raw", "raw: raw\nraw: raw", "duplicate-key", 3, "raw", "line 2"),
        ("title: Test", "title: &a Test", "alias", 1, "8", "'&a'"),
        ("title: Test", "title: *a", "alias", 1, "8", "'*a'"),
        ("title: Test", "title: !!python/name:os.system x", "tag", 1, "8", "(!)"),
        (
            "container: {length_cm: 24, width_cm: 22, depth_cm: 15}",
            "container:",
            "wrong-type",
            8,
            "container",
            "nothing",
        ),
        (
            "container: {",
            "fit: {horizontal_depths_cm: [2, -1]}\ncontainer: {",
            "out-of-range",
            8,
            "fit.horizontal_depths_cm.2",
            "",
        ),
        (
            "container: {",
            "fit: {min_points: 2.5}\ncontainer: {",
            "wrong-type",
            8,
            "fit.min_points",
            "whole number",
        ),
        (
            "container: {",
            "fit: {confidence: 95}\ncontainer: {",
            "out-of-range",
            8,
            "fit.confidence",
            "below 1",
        ),
        ("media:", "--- {}\nmedia:", "not-yaml", 14, "1", ""),
        ("raw: raw", "raw: ../raw", "path-outside", 2, "raw", "without .."),
        ("raw: raw", "raw: /raw", "path-outside", 2, "raw", "a relative path"),
        ("raw: raw", "raw: C:/raw", "path-outside", 2, "raw", "a relative path"),
        ("raw: raw", "raw: a\\b", "backslash", 2, "raw", "'a/b'?"),
        ("raw: raw", "raw: rau", "raw-missing", 2, "raw", "'raw'?"),
        ("raw: raw", "raw: ./", "raw-is-root", 2, "raw", "below"),
        ("raw: raw", 'raw: ""', "path", 2, "raw", "not blank"),
        ("raw: raw", 'raw: "a\\0b"', "control", 2, "6", ""),
        ("run_sheet: runs.csv", "run_sheet: ../runs.csv", "path-outside", 3, "run_sheet", ""),
    ],
)
def test_each_fault_has_its_place(room, old, new, code, line, key, value):
    """`key`: or the column, where no key can be read. `value`: what the problem names beside it."""
    room.config = room.config.replace(old, new, 1)
    (problem,) = (problem for problem in room.check() if problem.code == f"config.{code}")
    place = problem.place
    assert (place.file, place.line, place.key or place.column) == ("config/config.yaml", line, key)
    assert value in str(problem)


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        ("errors", "bed_percent", "1e308"),
        ("errors", "bed_percent", "100.5"),
        ("errors", "angle_deg", "91"),
        ("errors", "bed_N_per_cm3", "1e6"),
        ("fit", "submergence_cm", "-1"),
        ("fit", "max_depth_cm", "1e300"),
        ("arm", "surface_z_mm", "-1e9"),
        ("clock", "max_drift", "1.5"),
        ("fourier", "threshold", "2"),
    ],
)
def test_a_number_that_no_laboratory_has_is_refused(room, section, key, value):
    room.config = f"{room.config.rstrip()}\n{section}: {{{key}: {value}}}\n"
    problem = room.only("config.out-of-range")
    assert problem.place.key == f"{section}.{key}"


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


@pytest.mark.parametrize(
    ("texts", "code"),
    [(["", "# nothing\n", "---\n", "~"], "empty"), (["3", "[1, 2]", "word"], "wrong-type")],
)
def test_a_config_without_a_section(room, texts, code):
    for room.config in texts:
        assert room.only(f"config.{code}").place.file == "config/config.yaml"


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
    "text",
    [
        "[" * 100_000,
        "{a: " * 50_000,
        "- " * 50_000,
        "[" + "a," * 20_000 + "]",
        "a:\n" + "".join(f" k{i}: 1\n" for i in range(20_000)),
    ],
)
def test_bombs_are_refused(room, text):
    room.config = text
    assert "16" in room.only("config.too-large").allowed


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


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        (
            "{dialect: delimited, text: {delimiter: ',', encoding: utf-99}}",
            ".text.encoding",
            "'utf-99'; common ones: utf-8, cp1252, latin-1, shift_jis",
        ),
        ("{columns: {F1: {column: Fx, factor: 0}}}", ".columns.F1", "factor of 0 "),
        ("{columns: {F1: {unit: N}}}", ".columns.F1", "a column or a constant"),
        ("{dialect: delimited}", "", "delimited needs `text`"),
        ("{dialect: rig, text: {delimiter: ','}}", "", "`text` goes with the dialect delimited"),
    ],
)
def test_sections_of_logs(room, section, key, value):
    room.config += f"force_log: {section}\n"
    problem = room.only("config.inconsistent")
    assert problem.place.key == f"force_log{key}"
    assert value in problem.allowed
