"""The command line in this process."""

from __future__ import annotations

import re

import pytest

from pool_pymunk.cli import main

Capture = pytest.CaptureFixture[str]


def exit_code(*arguments: object) -> int:
    """Run the command line in this process and return its exit code."""
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    return int(ended.value.code or 0)


REMARK = re.compile(r"^Warning: .*\n", re.MULTILINE)  # what a command says on stderr of its runs


def without_remarks(said: str) -> str:
    """Return what stands on stderr besides warnings."""
    return REMARK.sub("", said)


def refusal(capsys: Capture, *arguments: object) -> str:
    """Return the one line on stderr that answers bad input."""
    assert exit_code(*arguments) == 2
    answer = capsys.readouterr()
    assert answer.out == ""
    (line,) = without_remarks(answer.err).splitlines()
    return line
