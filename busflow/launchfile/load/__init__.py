"""From YAML files to a description: includes, arguments, profiles, `${…}` and overrides. Imports no plugin.

`part.part_of` processes one file. Each step is a function that takes the result of the one before: read (`files`),
choose the profile, bind the arguments, expand, check the keys, add parameter files, flatten the groups, include, merge.
`load` applies the overrides of the command line and builds the description. One `Problems` object is passed down; it
collects the problems and the keys that are unknown because of them. At the end, `model/doubts` derives from these keys
which facts about the graph are unknown.
"""
