"""JSON Schema, checked by an independent validator: a file fits if and only if it loads."""

import json
import math
from pathlib import Path
from typing import Any, Literal

import jsonschema
import pytest
import yaml
from pydantic import Field

from busflow.launchfile.model.json_schema import PluginSchema, launch_schema
from busflow.launchfile.model.keys import IncludeKeys, LaunchKeys, NodeKeys
from busflow.node.parameters import Parameters, ReadOnly


class Noise(Parameters):
    imu: float = Field(default=0.1, ge=0)


class Joint(Parameters):
    name: str


class SensorParameters(Parameters):
    rate_hz: float = Field(default=10.0, gt=0, description="How often to publish.")
    noise: Noise = Noise()
    mode: Literal["fast", "slow"] = "fast"
    joints: tuple[Joint, ...] = ()
    frame: ReadOnly[str] = "imu_link"
    limit: float = math.inf
    title: str = ""


class MotorParameters(Parameters):
    port: str
    noise: str = "a parameter of the same name, and of another type"


SCHEMA = launch_schema([PluginSchema("sensor", SensorParameters, "Publishes."), PluginSchema("motor", MotorParameters)])
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


def fits(text: str) -> bool:
    return VALIDATOR.is_valid(yaml.safe_load(text))


def test_schema_is_valid_json_schema():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    json.dumps(SCHEMA, allow_nan=False)


def test_schema_depends_only_on_its_plugins():
    assert launch_schema() == launch_schema()
    assert "sensor.parameters" in SCHEMA["$defs"]
    assert "sensor.parameters" not in launch_schema()["$defs"]


@pytest.mark.parametrize(
    "text",
    [
        "nodes: {a: {plugin: sensor}}",
        "nodes: {a: {plugin: sensor, parameters: {rate_hz: 5, noise: {imu: 1}, mode: slow, title: x}}}",
        'nodes: {a: {plugin: sensor, parameters: {rate_hz: "${args.rate}", noise: {imu: "${args.n}"}}}}',
        'nodes: {a: {plugin: sensor, restart: "${args.r}", parameters: {joints: "${args.joints}"}}}',
        "nodes: {left/a: {plugin: sensor, parameters: }}",
        "nodes: {a: {plugin: 'other:Class', parameters: {anything: [1]}}}",
        "nodes: {a: {plugin: motor, parameters: {port: x}}}",
        "nodes: {a: {plugin: motor, parameters_from: motor.yaml}}",
        "nodes: {a: {parameters: {rate_hz: 5}}}",
        "args: {rate: {type: float, default: 1.0, min: 0}}\nseed: 5\nclock: {mode: sim}\nshutdown: {grace: 50ms}",
        "qos: {s: {depth: 5, deadline: 50ms, overflow: block}}\ntopics: {/a: {qos: s}, /b: {qos: {depth: 1}}}",
        "nodes: {a: {plugin: sensor, publishers: {imu: sensor_data}, subscriptions: {x: {depth: 2}}}}",
        'nodes: {"foot_${each.side}": {for_each: {side: [left, right]}, plugin: sensor, when: "${args.feet}"}}',
        'nodes: {a: {for_each: {side: "${args.sides}"}, namespace: "${each.side}", plugin: sensor, when: false}}',
        'topics: {"${each.n}/imu": {for_each: {n: [1, 2]}, qos: sensor_data}}',
        'include: [{file: "${each.f}.yaml", for_each: {f: [a, b]}, when: true}]',
        "groups: {arms: {namespace: arms, defaults: {restart: never}, nodes: {a: {plugin: sensor}}, when: true}}",
        "groups: {arms: {for_each: {n: [1]}, groups: {left: {include: a.yaml, topics: {x: {qos: default}}}}}}",
        "profile: ci\nprofiles: {ci: {args: {rate: {default: 5}}, nodes: {a: {when: false}}, clock: {mode: sim}}}",
        "env: {ROBOT: '${env.ROBOT:-r1}', OMP_NUM_THREADS: 1}\ndefaults: {parameters: {rate_hz: 5}}",
        "include: a.yaml",
        "include: [a.yaml, {file: b.yaml, args: {x: 1}, namespace: left}]",
        "x-note: {any: [thing]}\nnodes: {a: {plugin: sensor, x-b: 1}}",
        "plugins:\nnodes:\nargs:\n",
    ],
)
def test_loadable_files_fit_the_schema(text: str):
    VALIDATOR.validate(yaml.safe_load(text))


@pytest.mark.parametrize(
    "text",
    [
        "node: {}",
        "nodes: []",
        "nodes: {2a: {plugin: sensor}}",
        "nodes: {a: {plugin: sensor, paramters: {}}}",
        "nodes: {a: {plugin: sensor, restart: sometimes}}",
        "nodes: {a: {plugin: sensor, parameters: {rate_hzz: 5}}}",
        "nodes: {a: {plugin: sensor, parameters: {rate_hz: fast}}}",
        "nodes: {a: {plugin: sensor, parameters: {rate_hz: 0}}}",
        "nodes: {a: {plugin: sensor, parameters: {noise: {imu: -1}}}}",
        "nodes: {a: {plugin: sensor, parameters: {mode: medium}}}",
        "nodes: {a: {plugin: sensor, parameters: {joints: [{nam: x}]}}}",
        "nodes: {a: {plugin: motor}}",
        "nodes: {a: {plugin: motor, parameters: {noise: x}}}",
        "args: {rate: {default: 1}}",
        "args: {rate: {type: number}}",
        "qos: {s: {depth: 0}}",
        "qos: {s: {depht: 1}}",
        "topics: {/a: {qos: {reliability: best}}}",
        "shutdown: {grace: soon}",
        "include: [{fil: a}]",
        "nodes: {a: {plugin: sensor, for_each: [left]}}",
        "groups: {arms: {nodes: {a: {plugn: sensor}}}}",
        "groups: {arms: {args: {}}}",
        "defaults: {plugin: sensor}",
        "profiles: {ci: {nods: {}}}",
        "env: {ROBOT: [1]}",
        "nodes: {a: {plugin: sensor, when: 1}}",
        "seed: -1",
        "record: {}",
        "record: {to: run.mcap, compression: gzip}",
    ],
)
def test_wrong_files_do_not_fit_the_schema(text: str):
    assert not fits(text)


def test_schema_gives_editors_descriptions_defaults_and_names():
    rate = SCHEMA["$defs"]["sensor.parameters"]["properties"]["rate_hz"]
    assert (rate["description"], rate["default"]) == ("How often to publish.", 10.0)
    plugin = SCHEMA["$defs"]["NodeKeys"]["properties"]["plugin"]
    assert {"const": "sensor", "description": "Publishes."} in plugin["anyOf"]
    assert SCHEMA["$defs"]["sensor.parameters"]["properties"]["frame"]["readOnly"] is True
    assert "default" not in SCHEMA["$defs"]["sensor.parameters"]["properties"]["limit"]


@pytest.mark.parametrize(("section", "name"), [(LaunchKeys, ""), (NodeKeys, "NodeKeys"), (IncludeKeys, "IncludeKeys")])
def test_schema_describes_every_key_of_the_model(section: Any, name: str):
    described = SCHEMA["$defs"][name] if name else SCHEMA
    assert set(described["properties"]) == set(section.model_fields)
    for key, value in described["properties"].items():
        assert "description" in value or key in {"clock", "shutdown"}


def test_launch_files_of_the_project_fit():
    for path in (Path(__file__).parents[3] / "configs").glob("*.yaml"):
        jsonschema.Draft202012Validator(launch_schema()).validate(yaml.safe_load(path.read_text()))
