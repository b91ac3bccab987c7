"""Flood a server of this machine with requests of its page, and say what it answered.

    python tests/benchmarks/flood.py ADDRESS [--requests 20000] [--seconds 60] [--connections 8]

The requests come from 127.0.0.2, so that the server counts them as those of another client than
127.0.0.1. The last line is a JSON object: how many requests got each status.
"""

import argparse
import json
import sys
import threading
import time
from collections import Counter
from http.client import HTTPConnection, HTTPException
from itertools import count
from urllib.parse import urlsplit

_SOURCE = ("127.0.0.2", 0)


def flood(address: str, requests: int, seconds: float, connections: int) -> Counter[str]:
    """Return how many requests got each status, or an error of the connection."""
    parts, answers, lock = urlsplit(address), Counter[str](), threading.Lock()
    numbers, end = count(), time.monotonic() + seconds
    if parts.hostname != "127.0.0.1":
        raise ValueError(f"expected a server of this machine, found {address}")

    def ask() -> None:
        own, connection = Counter[str](), None
        while next(numbers) < requests and time.monotonic() < end:
            connection = connection or HTTPConnection(
                parts.netloc, timeout=20, source_address=_SOURCE
            )
            try:
                connection.request("GET", parts.path or "/")
                answer = connection.getresponse()
                answer.read()
                own[str(answer.status)] += 1
                if answer.will_close:
                    connection.close()
            except (OSError, HTTPException) as error:
                own[type(error).__name__] += 1
                connection.close()
                connection = None
        with lock:
            answers.update(own)

    threads = [threading.Thread(target=ask) for _ in range(connections)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return answers


def main() -> None:
    parser = argparse.ArgumentParser(description="Flood a server of this machine.")
    parser.add_argument("address")
    parser.add_argument("--requests", type=int, default=20_000)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--connections", type=int, default=8)
    asked = parser.parse_args()
    answers = flood(asked.address, asked.requests, asked.seconds, asked.connections)
    sys.stdout.write(json.dumps(answers) + "\n")


if __name__ == "__main__":
    main()
