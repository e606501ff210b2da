"""Versions that a launch file asks for, and how a deprecation is announced."""

import warnings

import pytest

import busflow
from busflow.validation import versions
from busflow.validation.versions import check_requirement, warn_of
from tests.golden import Golden


@pytest.mark.parametrize("text", [">=0.1", ">=0.1,<0.3", "==0.2.7", "~=0.2.1"])
def test_versions_that_include_this_one_are_accepted(text: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(busflow, "__version__", "0.2.7")
    assert check_requirement(text) == text


def test_other_version_is_refused_in_words(monkeypatch: pytest.MonkeyPatch, golden: Golden):
    monkeypatch.setattr(busflow, "__version__", "0.1.9")
    with golden.raises(ValueError):
        check_requirement(">=0.2")


def test_text_that_names_no_version_is_refused(golden):
    with golden.raises(ValueError):
        check_requirement("new")


def test_warning_points_to_the_line_outside_busflow():
    """What warns is called by other functions of busflow, as a deprecated method would be."""
    inside = {"__name__": "busflow.node.node", "warn_of": warn_of}
    exec("def old():\n    warn_of('Node.old', instead='write Node.new', gone_in='0.3')\n", inside)  # noqa: S102  # our own text
    with pytest.warns(DeprecationWarning, match=r"^Node\.old .* 0\.3: write Node\.new$") as seen:
        inside["old"]()
    assert [warning.filename for warning in seen] == [__file__]


def test_python_shows_it_where_a_test_does():
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        with pytest.raises(DeprecationWarning):
            warn_of("x", instead="y", gone_in=versions.__name__)
