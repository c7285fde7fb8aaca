"""All links and pictures of the documentation work in any Markdown viewer, without a build."""

import re
import subprocess
from html import unescape

import pytest
from pages import ROOT, pages

import rftfit

OTHER_PAGES = (
    "CHANGELOG.md",
    "CODE_OF_CONDUCT.md",
    "CONTRIBUTING.md",
    "SECURITY.md",
    "SUPPORT.md",
    "benchmarks/README.md",
    "config/README.md",
    "examples/cmu-sand/README.md",
    "examples/paper/README.md",
    "examples/robot-leg/README.md",
    "examples/wheels/README.md",
    "raw/README.md",
    "requirements/README.md",
    "tests/golden/README.md",
)
PAGES = [*pages(), *OTHER_PAGES]
_SITE = re.compile(r"^<!-- site\n.*?^-->\n", re.MULTILINE | re.DOTALL)
_FENCED = re.compile(r"^(`{3,}|~{3,}).*?^\1\s*$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(<?([^)\s>]*)>?(?: \"[^\"]*\")?\)")
_TAG = re.compile(r"<(a|img)\b[^>]*\b(?:href|src)=\"([^\"]*)\"[^>]*>([^<]*)")
_FAR = re.compile(r"https?://[\w.-]+\.\w+(/\S*)?|mailto:\S+@\S+")
_DIRECTIVE = re.compile(
    r"^\s*(?:`{3,}|:{3,}|~{3,})\{[\w-]+\}|\{(?:ref|doc|term|math|numref|download)\}`"
    r"|\]\([^)]*\)\{[^}]*\}|^\([\w-]+\)=$",
    re.MULTILINE,
)


def text_of(page):
    """Return a page as a plain viewer shows it, without the comments for the build of the site."""
    return _SITE.sub("", (ROOT / page).read_text("utf-8"))


def without_code(text):
    return re.sub(r"`[^`\n]+`", "code", _FENCED.sub("", text))


def places_in(text):
    """Return the anchors of the headings of a page, as repository viewers make them."""
    headings = re.findall(r"^#{1,6} +(.+?)\s*$", _FENCED.sub("", text), re.MULTILINE)
    lowered = (re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower() for heading in headings)
    return {re.sub(r"[^\w\- ]", "", heading).replace(" ", "-") for heading in lowered}


def broken_links(page, text, tracked):
    """Return what is wrong with the links and pictures of a page."""
    bare = without_code(text)
    links = [(target, words) for _, words, target in _LINK.findall(bare)]
    links += [
        (target, words or ("picture" if tag == "img" else ""))
        for tag, target, words in _TAG.findall(bare)
    ]
    problems = [f"no text: ({target})" for target, words in links if not words.strip()]
    for target, _ in links:
        if _FAR.fullmatch(target):
            continue
        address, _, place = unescape(target).partition("#")
        path = ((ROOT / page).parent / address).resolve() if address else ROOT / page
        if not path.is_relative_to(ROOT) or path.relative_to(ROOT).as_posix() not in tracked:
            problems.append(f"not in the repository: {target}")
        elif place and place not in places_in(text_of(path.relative_to(ROOT).as_posix())):
            problems.append(f"no such heading: {target}")
    return problems


@pytest.fixture(scope="module")
def tracked():
    """Files and folders that the repository holds."""
    done = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        pytest.skip("not a clone")
    files = set(done.stdout.splitlines())
    folders = {
        file.rsplit("/", depth)[0] for file in files for depth in range(1, file.count("/") + 1)
    }
    return files | folders


@pytest.mark.parametrize("page", PAGES)
def test_links_and_pictures_resolve_from_the_sources(page, tracked):
    assert broken_links(page, text_of(page), tracked) == []


@pytest.mark.parametrize("page", PAGES)
def test_no_directive_stands_where_a_plain_viewer_would_show_it(page):
    bare = re.sub(r"`[^`\n]+`", "code", text_of(page))
    assert [match[0] for match in _DIRECTIVE.finditer(bare)] == []


def test_a_link_that_leads_nowhere_is_seen(tracked):
    text = "[](docs/install.md) [a](gone.md) ![p](docs/_build/p.svg) [b](docs/install.md#no) [c](docs/install.md#install)"
    assert broken_links("README.md", text, tracked) == [
        "no text: (docs/install.md)",
        "not in the repository: gone.md",
        "not in the repository: docs/_build/p.svg",
        "no such heading: docs/install.md#no",
    ]


def test_the_readme_states_the_version_that_is_cited():
    text = text_of("README.md")
    assert set(re.findall(r"(?i)version (\d[\w.]*\d)", text)) == {rftfit.__version__}
    cited = (ROOT / "CITATION.cff").read_text("utf-8")
    assert f"\nversion: {rftfit.__version__}\n" in cited
