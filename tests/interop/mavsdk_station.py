"""A program as users write it with MAVSDK: reads all parameters, sets one, and arms.

Started by test_ground_stations.py with the address of the router; prints what it learned as JSON.
"""

import json
import sys

from mavsdk import ComponentType, Configuration, Mavsdk, MavsdkError
from mavsdk.plugins.action import Action
from mavsdk.plugins.param import Param

# MAVSDK gives up after a few seconds; on a busy machine that may be too early.
TRIES = 10


def patiently(call, *arguments):
    for _ in range(TRIES - 1):
        try:
            return call(*arguments)
        except MavsdkError as error:
            print(error, file=sys.stderr)
    return call(*arguments)


def main():
    station = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    station.add_any_connection(sys.argv[1])
    vehicle = station.first_autopilot(60.0)
    parameters, action = Param(vehicle), Action(vehicle)
    listed = patiently(parameters.get_all_params).float_params
    patiently(parameters.set_param_float, "TEST_007", -2.5)
    patiently(action.arm)
    learned = {
        "system": vehicle.get_system_id(),
        "parameters": {parameter.name: parameter.value for parameter in listed},
        "TEST_007": patiently(parameters.get_param_float, "TEST_007"),
    }
    print(json.dumps(learned))
    station.destroy()


main()
