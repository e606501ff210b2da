"""A script that runs all nodes of a file as a run of a name, and records it if a third word says where to."""

import importlib.util
import sys
from pathlib import Path

import busflow
from busflow import Node

file, name, *recording = sys.argv[1:]
spec = importlib.util.spec_from_file_location(Path(file).stem, file)
module = importlib.util.module_from_spec(spec)
sys.modules[spec.name] = module
spec.loader.exec_module(module)
own = [each for each in vars(module).values() if isinstance(each, type) and each.__module__ == spec.name]
nodes = [each for each in own if issubclass(each, Node)]
sys.exit(busflow.run(*nodes, inspect=name, record=recording[0] if recording else None))
