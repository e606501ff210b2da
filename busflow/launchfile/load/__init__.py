"""From YAML files to a description: includes, arguments, profiles, `${…}` and overrides. Imports no plugin."""
