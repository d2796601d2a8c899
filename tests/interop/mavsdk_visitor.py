"""A ground station of MAVSDK's client plugins, which asks an autopilot for all that it has.

Started by the tests with the address of the router and a directory to put files into; prints what it
learned as JSON.
"""

import json
import sys
import threading
import time

from mavsdk import ComponentType, Configuration, Mavsdk, MavsdkError
from mavsdk.plugins.action import Action
from mavsdk.plugins.ftp import Ftp, FtpResult
from mavsdk.plugins.mission_raw import MissionItem, MissionRaw
from mavsdk.plugins.param import Param
from mavsdk.plugins.telemetry import Telemetry

# MAVSDK gives up after a few seconds; on a busy machine that may be too early.
TRIES = 10


def patiently(call, *arguments):
    for _ in range(TRIES - 1):
        try:
            return call(*arguments)
        except MavsdkError as error:
            print(error, file=sys.stderr)
            time.sleep(0.2)
    return call(*arguments)


def waypoint(number):
    place = {"x": 472_500_000 + number, "y": 85_000_000 - number, "z": 20.0 + number}
    # In MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, MAV_CMD_NAV_WAYPOINT.
    head = {"seq": number, "frame": 6, "command": 16, "current": int(number == 0)}
    return MissionItem(**head, autocontinue=1, **place)


def download(ftp, name, directory):
    """Fetches a file; the result of the last answer."""
    ended, results = threading.Event(), []

    def on_progress(result, _progress, _data):
        results.append(result)
        if result != FtpResult.NEXT:
            ended.set()

    ftp.download_async(name, directory, False, on_progress)
    ended.wait(60.0)
    return results[-1].name if results else "no answer"


def first_position(telemetry):
    """The first position that is told."""
    told, positions = threading.Event(), []
    telemetry.subscribe_position(lambda position, _data: (positions.append(position), told.set()))
    told.wait(60.0)
    return [positions[0].latitude_deg, positions[0].longitude_deg]


def main():
    station = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    station.add_any_connection(sys.argv[1])
    vehicle = station.first_autopilot(60.0)
    telemetry, parameters = Telemetry(vehicle), Param(vehicle)
    mission, action, ftp = MissionRaw(vehicle), Action(vehicle), Ftp(vehicle)
    learned = {"position": first_position(telemetry)}
    listed = patiently(parameters.get_all_params).float_params
    learned["parameters"] = {parameter.name: parameter.value for parameter in listed}
    patiently(parameters.set_param_float, "SERVED_03", -2.5)
    learned["SERVED_03"] = patiently(parameters.get_param_float, "SERVED_03")
    waypoints = [waypoint(number) for number in range(25)]
    patiently(mission.upload_mission, waypoints)
    back = patiently(mission.download_mission)
    learned["mission"] = [[item.x, item.y, item.z] for item in back]
    learned["sent"] = [[item.x, item.y, item.z] for item in waypoints]
    learned["file"] = download(ftp, "log.bin", sys.argv[2])
    patiently(action.arm)
    patiently(action.takeoff)
    learned["commands"] = "accepted"
    print(json.dumps(learned))
    station.destroy()


main()
