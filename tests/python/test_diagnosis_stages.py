from __future__ import annotations

import pytest
from hdfast.diagnosis.stages import stages
from hdfast.errors import InputError


def test_exact_a_function_is_told_every_sentence():
    told = []
    with stages(told.append) as progress:
        progress.expect(2)
        progress.done("first")
        progress.say("between")
        progress.done("second")
    assert told == ["first", "between", "second"]


def test_exact_a_bar_counts_the_steps_it_expects(capsys):
    with stages(True) as progress:
        progress.expect(1)
        progress.done("first")
        progress.expect(3)
        for name in ("second", "third", "fourth"):
            progress.done(name)
    text = capsys.readouterr().err
    assert "fourth" in text
    assert "4/4" in text


def test_exact_silence_writes_nothing(capsys):
    with stages(False) as progress:
        progress.expect(1)
        progress.done("first")
    assert capsys.readouterr() == ("", "")


def test_exact_wrong_progress_is_named():
    with pytest.raises(InputError, match=r"progress = 3 is not True, False or a function"), stages(3):
        pass
