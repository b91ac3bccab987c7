"""The source of the pages: headings, fenced blocks and the marks above them."""

import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from solver.io.lock import locked

REPOSITORY = Path(__file__).resolve().parents[2]
DOCS = REPOSITORY / "assets" / "docs"
README = REPOSITORY / "README.md"
PAGES = sorted(DOCS.glob("*.md"))

_FENCE = re.compile(r"^```(?P<language>\S*)\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)
_MARK = re.compile(r"<!-- not run: (.+) -->")


@dataclass(frozen=True)
class Block:
    """A fenced block with its page, its line number and the line above it."""

    page: Path
    line: int
    language: str
    text: str
    above: str

    @property
    def reason(self):
        """The page's reason for not running it; "" if it is to be run."""
        found = _MARK.fullmatch(self.above)
        return found[1] if found else ""

    @property
    def name(self):
        return f"{self.page.stem}-{self.line}"

    def commands(self):
        """Return its lines without comments; lines continued with a backslash are joined."""
        joined = self.text.replace("\\\n", " ")
        lines = (re.split(r"(?:^|\s)#", line)[0].strip() for line in joined.splitlines())
        return [line for line in lines if line]


def blocks_of(page, *languages):
    """Return the blocks of a page in the given languages, in order."""
    text = page.read_text("utf-8")
    found = []
    for match in _FENCE.finditer(text):
        before = text[: match.start()].rstrip("\n").splitlines()
        number = text.count("\n", 0, match.start()) + 1
        found.append(Block(page, number, match[1], match[2], before[-1] if before else ""))
    return [block for block in found if block.language in languages]


def headings_of(page):
    """Return the headings of a page below its title, in order."""
    without_blocks = _FENCE.sub("", page.read_text("utf-8"))
    return re.findall(r"^##+ (.+)$", without_blocks, flags=re.MULTILINE)


def section_of(page, heading):
    """Return the text from a heading to the next one."""
    text = page.read_text("utf-8")
    begin = re.search(rf"^##+ {re.escape(heading)}$", text, flags=re.MULTILINE).end()
    rest = text[begin:]
    following = re.search(r"^##+ ", rest, flags=re.MULTILINE)
    return rest[: following.start()] if following else rest


def built_site(tmp_path_factory):
    """Return the folder of the site, which one of the processes of a test run builds."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    with locked(shared, wait=True):
        if not (shared / "site").is_dir():
            _build_site(shared / "building").rename(shared / "site")
    return shared / "site"


def _build_site(folder):
    """Build the site as in the README and return its folder; a warning is an error."""
    build = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going"]
    places = ["-d", str(folder / "doctrees"), str(DOCS), str(folder / "html")]
    run = subprocess.run(
        [*build, *places], cwd=REPOSITORY, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    return folder / "html"
