"""The design studies of the book: their commands run as they stand, and reach the numbers that the pages state.

A comment in a page, which readers do not see, states a number: `<!-- states: COMMAND | KEY | VALUE | TOLERANCE -->`. COMMAND is run with `--json` after
the commands of the page, or is a JSON file that they made; KEY is the place in its result, with dots between names.
"""
import glob
import json
import os
import re
import shlex

import pytest

STUDIES = os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))), "docs", "studies")
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
STATES = re.compile(r"<!-- states: (.*?) \| (.*?) \| (.*?) \| (.*?) -->")


def pages():
    return sorted(glob.glob(os.path.join(STUDIES, "*.md")))


def commands(text):
    """The lines of the blocks without a language or with `sh`; a line that ends in a backslash goes on in the next one."""
    for language, body in BLOCK.findall(text):
        if language in ("", "sh"):
            yield from filter(None, (line.strip() for line in body.replace("\\\n", " ").split("\n")))


def test_there_are_three_studies():
    assert len(pages()) >= 3


@pytest.mark.parametrize("page", [os.path.basename(p) for p in pages()])
def test_a_study_reaches_what_its_page_states(cittert, page):
    with open(os.path.join(STUDIES, page)) as f:
        text = f.read()
    os.symlink(os.path.join(os.path.dirname(os.path.dirname(STUDIES)), "docs"), cittert.path("docs"))
    os.symlink(os.path.join(os.path.dirname(os.path.dirname(STUDIES)), "phenomenology"), cittert.path("phenomenology"))
    for line in commands(text):
        words = shlex.split(line)
        if words[0] == "cittert":
            cittert(*words[1:])
        else:
            assert words[0] == "printf" and words[-2] == ">", f"{line}: what is this command?"
            with open(cittert.path(words[-1]), "w") as f:
                f.write(words[1].encode().decode("unicode_escape"))
    stated = STATES.findall(text)
    assert len(stated) >= 3, f"{page} states only {len(stated)} numbers"
    for command, key, value, tolerance in stated:
        if command.endswith(".json"):
            with open(cittert.path(command)) as f:
                found = json.load(f)
        else:
            found = cittert.json(*shlex.split(command))
        for name in key.split("."):
            found = found[int(name)] if name.isdigit() else found[name]
        assert abs(float(found) - float(value)) <= float(tolerance), f"{page}: {command}: {key} is {found}, the page states {value}"
