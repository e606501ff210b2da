"""`Resolver`: replaces every `${…}` in a tree of values and collects the problems."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from busflow.errors import KeyPath, LaunchError
from busflow.launchfile.load.expression import Scope, Template
from busflow.launchfile.model.problems import Problems, key_origin, problem_at
from busflow.launchfile.yaml.value import Value
from busflow.validation.faults import shown


@dataclass(slots=True)
class Resolver:
    """Replaces the expressions in values and collects the problems."""

    scope: Scope
    problems: Problems
    failed: set[KeyPath] = field(default_factory=set[KeyPath])
    """Paths whose expressions failed; they still hold the text of the expression."""

    def resolve(self, value: Value, path: KeyPath = (), *, as_text: bool = False) -> Value:
        """Return the value with every expression in it replaced.

        Args:
            value: A value that may hold expressions.
            path: Its path, for `failed`.
            as_text: Keep environment variables as text instead of reading them as YAML.
        """
        content = value.content
        if isinstance(content, dict):
            members: dict[str, Value] = {}
            for stated, each in content.items():
                key = self._key(stated, each, path) if "${" in stated else stated
                if key in members:
                    message, fix = f"two keys are {key} once their expressions are replaced", "leave one of them out"
                    self.problems.add(problem_at("duplicate-key", message, fix, key_origin(each)))
                members[key] = self.resolve(each, (*path, key), as_text=as_text)
            return replace(value, content=members)
        if isinstance(content, list):
            items = [self.resolve(each, (*path, n), as_text=as_text) for n, each in enumerate(content)]
            return replace(value, content=items)
        if not isinstance(content, str) or "${" not in content:
            return value
        try:
            data, through = Template(value, content, self.scope, as_text=as_text).evaluate()
        except LaunchError as error:
            self.failed.add(path)
            self.problems.add(*error.problems, left_out=())  # the caller adds the failed paths to `left_out`
            return value
        origin = replace(value.origin, through=through)
        return replace(Value.of(data, origin), key=value.key)

    def _key(self, key: str, value: Value, path: KeyPath) -> str:
        """Return a key with its expressions replaced; keys may hold them only inside a `for_each`."""
        stated = Value(key, key_origin(value))
        if not self.scope.each:
            message, fix = "a key cannot hold an expression", "write it out; only below for_each keys hold expressions"
            self.problems.add(problem_at("expression", message, fix, stated.origin), left_out=())
            self.failed.add((*path, key))
            return key
        found = self.resolve(stated, (*path, key), as_text=True).content
        return found if isinstance(found, str) else shown(found)
