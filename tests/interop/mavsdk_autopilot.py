"""An autopilot of MAVSDK's server plugins: telemetry, parameters, a mission, actions and files.

Started by the tests with the address of the router and a directory whose files it hands out. Ends when
its standard input does.
"""

import sys
import threading

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.action_server import ActionServer
from mavsdk.plugins.ftp_server import FtpServer
from mavsdk.plugins.mission_raw_server import MissionRawServer
from mavsdk.plugins.param_server import ParamServer
from mavsdk.plugins.telemetry_server import Heading, Position, TelemetryServer, VelocityNed

PARAMETERS = {f"SERVED_{number:02}": number * 0.5 for number in range(20)}
LATITUDE, LONGITUDE, ALTITUDE = 47.25, 8.5, 450.0


def main():
    autopilot = Mavsdk(Configuration.create_with_component_type(ComponentType.AUTOPILOT))
    autopilot.add_any_connection(sys.argv[1])
    component = autopilot.server_component()
    files = FtpServer(component)
    files.set_root_dir(sys.argv[2])
    parameters = ParamServer(component)
    for name, value in PARAMETERS.items():
        parameters.provide_param_float(name, value)
    telemetry, actions = TelemetryServer(component), ActionServer(component)
    actions.set_armable(True, True)
    actions.set_disarmable(True, True)
    actions.set_allow_takeoff(True)
    mission = MissionRawServer(component)
    mission.subscribe_incoming_mission(lambda *_: None)
    position = Position(LATITUDE, LONGITUDE, ALTITUDE, 10.0)
    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    while not ended.wait(0.2):
        telemetry.publish_position(position, VelocityNed(0.0, 0.0, 0.0), Heading(90.0))
    autopilot.destroy()


if __name__ == "__main__":
    main()
