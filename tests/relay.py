#!/usr/bin/python3
"""relay.py SEED LISTEN_HOST:PORT=TARGET_HOST:PORT …: passes connections on, and delays, stalls and cuts them at random.

The same seed gives each connection the same faults in the same order. Prints a line per fault at the end."""

import asyncio
import random
import signal
import sys

DELAY_MAX_S = 0.002
STALL_S = 0.15
STALL_PROBABILITY = 0.002
CUT_PROBABILITY = 0.001
faults = {"delays": 0, "stalls": 0, "cuts": 0, "connections": 0}


async def pass_on(reader, writer, chance):
    while data := await reader.read(65536):
        if chance.random() < CUT_PROBABILITY:
            faults["cuts"] += 1
            raise ConnectionAbortedError
        if chance.random() < STALL_PROBABILITY:
            faults["stalls"] += 1
            await asyncio.sleep(STALL_S)
        else:
            faults["delays"] += 1
            await asyncio.sleep(chance.uniform(0, DELAY_MAX_S))
        writer.write(data)
        await writer.drain()


def relay_to(host, port, seed):
    async def serve(reader, writer):
        faults["connections"] += 1
        chance = random.Random(f"{seed} {port} {faults['connections']}")
        try:
            there_reader, there_writer = await asyncio.open_connection(host, port)
        except OSError:
            writer.transport.abort()
            return
        both = [asyncio.ensure_future(pass_on(reader, there_writer, chance)),
                asyncio.ensure_future(pass_on(there_reader, writer, chance))]
        await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
        for direction in both:
            direction.cancel()
        await asyncio.gather(*both, return_exceptions=True)
        writer.transport.abort()
        there_writer.transport.abort()

    return serve


async def main():
    seed = sys.argv[1]
    stopped = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, stopped.set)
    for words in sys.argv[2:]:
        listen, target = words.split("=")
        host, port = listen.rsplit(":", 1)
        there, there_port = target.rsplit(":", 1)
        await asyncio.start_server(relay_to(there, int(there_port), seed), host, int(port))
    print("relaying", flush=True)
    await stopped.wait()
    print(", ".join(f"{count} {name}" for name, count in faults.items()), flush=True)


asyncio.run(main())
