"""A program that opens a session of Zenoh at an address, with settings, and exits with 7 where it is not let in."""

import json
import sys

import zenoh

config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([sys.argv[1]]))
config.insert_json5("scouting/multicast/enabled", "false")
for key, value in json.loads(sys.argv[2]).items():
    config.insert_json5(key, json.dumps(value))
try:
    zenoh.open(config).close()
except zenoh.ZError:
    sys.exit(7)
