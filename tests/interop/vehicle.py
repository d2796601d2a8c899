"""The scripted vehicle 1/1: parameters, commands, a mission and files, as an autopilot answers."""

from files import FileServer
from peers import Peer, mavlink2, source

# Short of what a UDP socket holds, since the whole list is sent at once; exact as 32-bit floats.
PARAMETERS = {f"TEST_{number:03}": number * 0.25 for number in range(120)}


def mission(count):
    """Waypoints: the fields of MISSION_ITEM_INT that are not addresses."""
    return [
        {
            "seq": seq,
            "frame": mavlink2.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
            "command": mavlink2.MAV_CMD_NAV_WAYPOINT,
            "current": int(seq == 0),
            "autocontinue": 1,
            "param1": 0.5 * seq,
            "param2": 0.0,
            "param3": 0.0,
            "param4": 0.0,
            "x": 473_000_000 + seq,
            "y": 85_000_000 - seq,
            "z": 10.0 + seq,
        }
        for seq in range(count)
    ]


def waypoint(message):
    """A waypoint out of the message that carried it, as `mission` writes them."""
    return {field: getattr(message, field) for field in mission(1)[0]}


class Vehicle(Peer):
    """An autopilot as a ground station knows it."""

    TYPE = mavlink2.MAV_TYPE_QUADROTOR
    AUTOPILOT = mavlink2.MAV_AUTOPILOT_ARDUPILOTMEGA

    def __init__(self, **options):
        super().__init__(1, 1, **options)
        self.parameters = dict(PARAMETERS)
        self.mission = []
        self.armed = False
        self.ftp = FileServer()
        # The mission that is being uploaded, and how long it will be.
        self._upload = []
        self._upload_len = 0

    def answer(self, message):
        is_for_us = getattr(message, "target_system", 0) in (0, self.system)
        handler = getattr(self, f"_on_{message.get_type().lower()}", None)
        if is_for_us and handler:
            asker = dict(zip(("target_system", "target_component"), source(message)))
            handler(message, asker)

    def _on_param_request_list(self, _message, _asker):
        for name in self.parameters:
            self._tell_parameter(name)

    def _on_param_request_read(self, message, _asker):
        names = list(self.parameters)
        if message.param_index >= 0:
            name = names[message.param_index] if message.param_index < len(names) else None
        else:
            name = message.param_id
        if name in self.parameters:
            self._tell_parameter(name)

    def _on_param_set(self, message, _asker):
        self.parameters[message.param_id] = message.param_value
        self._tell_parameter(message.param_id)

    def _tell_parameter(self, name):
        self.say(
            "param_value",
            param_id=name.encode(),
            param_value=self.parameters[name],
            param_type=mavlink2.MAV_PARAM_TYPE_REAL32,
            param_count=len(self.parameters),
            param_index=list(self.parameters).index(name),
        )

    def _on_command_long(self, message, asker):
        result = mavlink2.MAV_RESULT_UNSUPPORTED
        if message.command == mavlink2.MAV_CMD_COMPONENT_ARM_DISARM:
            self.armed = message.param1 == 1.0
            result = mavlink2.MAV_RESULT_ACCEPTED
        self.say("command_ack", command=message.command, result=result, **asker)

    def _on_file_transfer_protocol(self, message, asker):
        for payload in self.ftp.answer(message.payload):
            self.say("file_transfer_protocol", target_network=0, payload=payload, **asker)

    def _on_mission_count(self, message, asker):
        self._upload, self._upload_len = [], message.count
        self.say("mission_request_int", seq=0, **asker)

    def _on_mission_item_int(self, message, asker):
        self._upload.append(waypoint(message))
        if len(self._upload) < self._upload_len:
            self.say("mission_request_int", seq=len(self._upload), **asker)
        else:
            self.mission = self._upload
            self.say("mission_ack", type=mavlink2.MAV_MISSION_ACCEPTED, **asker)

    def _on_mission_request_list(self, _message, asker):
        self.say("mission_count", count=len(self.mission), **asker)

    def _on_mission_request_int(self, message, asker):
        self.say("mission_item_int", **self.mission[message.seq], **asker)
