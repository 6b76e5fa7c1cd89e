"""A request for a job, as it comes in."""

import os
import socket

HEADER = 20  # characters of the line that says how many bytes follow
LARGEST = 1 << 24  # bytes of a request; systems allow environments less


class Request:
    """Request of a client as received so far: folder, script, environment, and three streams.

    Parameters
    ----------
    client : connection, which is not waited for
    until : when its patience ends, seconds of the monotonic clock
    """

    def __init__(self, client: socket.socket, until: float) -> None:
        client.setblocking(False)
        self.client = client
        self.until = until
        self.streams: list[int] = []
        self._content = b""

    def read(self) -> bool:
        """Whether the request is complete, with what there is to read now.

        Raises
        ------
        OSError, ValueError
            The client is gone, or this is no request.
        """
        more, streams, _, _ = socket.recv_fds(self.client, 1 << 16, 3)
        self.streams += streams
        self._content += more
        if not more:
            raise OSError("the client is gone")
        if len(self._content) < HEADER:
            return False
        size = int(self._content[:HEADER])
        if not 0 < size <= LARGEST:
            raise ValueError(f"a request of {size} bytes")
        return len(self._content) >= HEADER + size

    def parts(self) -> list[str]:
        """Folder, script and environment; ValueError if something is missing."""
        found = self._content[HEADER:].decode("utf-8", "surrogateescape").split("\0")
        if len(found) < 2 or len(self.streams) != 3:
            raise ValueError("no folder, script or streams")
        return found

    def close_streams(self) -> None:
        """Close the server's copies of the streams."""
        for stream in self.streams:
            os.close(stream)
