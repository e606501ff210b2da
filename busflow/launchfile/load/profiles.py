"""Profiles: what is different in a launch file under a name, laid over the rest before any expression is read."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from busflow.errors import LaunchError, Place
from busflow.launchfile.load.expand import Expander
from busflow.launchfile.load.expression import Scope
from busflow.launchfile.load.resolver import Resolver
from busflow.launchfile.model.problems import Problems, problem_at
from busflow.launchfile.yaml.document import Limits
from busflow.launchfile.yaml.value import Origin, Source, Value
from busflow.text import did_you_mean


def from_command_line(names: Iterable[str]) -> list[Value]:
    """The profiles that `--profile` names."""
    label, option = Source.COMMAND_LINE.value, "--profile "
    places = ((name, Place(label, 1, len(option) + 1, max(1, len(name)), option + name)) for name in names)
    return [Value(name, Origin(Source.COMMAND_LINE, place)) for name, place in places]


def chosen(root: Value, asked: Sequence[Value], scope: Scope, problems: Problems) -> Value:
    """A file under the profiles that are asked for, the last one on top; under its own `profile` if none is."""
    stated = root.members.get("profile")
    if not asked and stated is not None and stated.content is not None:
        resolver = Resolver(scope, problems)
        asked = [resolver.resolve(stated)]
        asked = [] if resolver.failed else asked
    known = root.section("profiles")
    under = root
    for each in asked:
        profile = known.get(str(each.content))
        if profile is None:
            fix = did_you_mean(str(each.content), known) if known else "add it below `profiles:`"
            problems.add(problem_at("unknown-profile", f"there is no profile {each.content!r}", fix, each.origin))
        elif isinstance(profile.content, dict):  # or else it is told with the other keys
            under = replace(under.merged(profile), origin=root.origin)
    return under


def readable(profiles: Value, scope: Scope, limits: Limits) -> Value:
    """Profiles as they can be checked although nobody has chosen them: without what cannot be evaluated."""
    members: dict[str, Value] = {}
    for name, profile in profiles.members.items():
        try:
            value, failed = Expander(scope, Problems(), limits).expand(profile)
        except LaunchError:
            continue
        members[name] = value.without_any(failed)
    return replace(profiles, content=members) if isinstance(profiles.content, dict) else profiles
