"""Subscribes to all that a Foxglove WebSocket offers and prints what came, as one JSON object: `client.py PORT`."""

import asyncio
import base64
import json
import struct
import sys

import websockets

PROTOCOL = "foxglove.sdk.v1"


async def main(port):
    channels, seen = {}, {"channels": {}, "poses": [], "clouds": [], "seen": [], "transforms": 0}
    uri = f"ws://127.0.0.1:{port}"
    async with websockets.connect(uri, subprotocols=[PROTOCOL], max_size=None) as socket:
        assert socket.subprotocol == PROTOCOL, socket.subprotocol
        try:
            async for message in socket:
                if isinstance(message, str):
                    await answer(socket, json.loads(message), channels, seen)
                else:
                    take(message, channels, seen)
        except websockets.ConnectionClosed:
            pass
    print(json.dumps(seen))


async def answer(socket, told, channels, seen):
    """Subscribes to the channels that are offered, each by its own number."""
    if told["op"] == "serverInfo":
        seen["name"] = told["name"]
    if told["op"] != "advertise":
        return
    for channel in told["channels"]:
        assert (channel["encoding"], channel["schemaEncoding"]) == ("json", "jsonschema"), channel
        assert json.loads(channel["schema"])["title"] == channel["schemaName"]
        channels[channel["id"]] = channel["topic"]
        seen["channels"][channel["topic"]] = channel["schemaName"]
    wanted = [{"id": channel["id"], "channelId": channel["id"]} for channel in told["channels"]]
    await socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
    if len(channels) == 4:
        print("subscribed", file=sys.stderr, flush=True)


def take(message, channels, seen):
    """A message: 1, the subscription's number, the time (ns), and JSON."""
    kind, subscription, _time = struct.unpack_from("<BIQ", message)
    if kind != 1:
        return
    topic, value = channels[subscription], json.loads(message[13:])
    if topic in ("/points", "/seen"):
        data = base64.b64decode(value["data"])
        places = list(struct.iter_unpack("<ff", data))
        assert value["point_stride"] == 8 and len(data) % 8 == 0
        farthest = max((max(abs(x), abs(y)) for x, y in places), default=0)
        seen["clouds" if topic == "/points" else "seen"].append([value["frame_id"], len(places), farthest])
    elif topic == "/pose/estimate":
        at, turned = value["pose"]["position"], value["pose"]["orientation"]
        seen["poses"].append([at["x"], at["y"], turned["z"], turned["w"]])
    elif topic == "/tf":
        assert (value["parent_frame_id"], value["child_frame_id"]) == ("map", "robot")
        seen["transforms"] += 1


asyncio.run(main(int(sys.argv[1])))
