"""From YAML files to a description: includes, arguments, profiles, `${…}` and overrides. Imports no plugin.

`part.part_of` is the way of one file, each step a function that takes what the one before has returned: read (`files`),
choose the profile, bind the arguments, expand, check the keys, add files of parameters, flatten the groups, include,
merge. `load` lays the command line over the whole and builds the description. Problems are collected in one object that
is passed down, with the keys that are not known because of them; what that leaves open of the graph is worked out once,
at the end (`model/doubts`).
"""
