"""A client of a language server over standard input and output, as small as the tests need it.

The protocol: JSON-RPC messages with a `Content-Length` header (Language Server Protocol 3.17). Every wait is bounded.
"""

from __future__ import annotations

import json
import subprocess
import threading
from pathlib import Path
from queue import Empty, Queue
from types import TracebackType
from typing import Any

Json = dict[str, Any]
PATIENCE = 60.0  # s for one answer
SETTINGS: Json = {
    "yaml": {"validate": True, "hover": True, "completion": True, "schemaStore": {"enable": False}},
    "http": {"proxyStrictSSL": True},
    "[yaml]": {},
    "editor": {},
    "files": {},
}


class LanguageServer:
    """A running server with one folder open; a context manager, so that no process is left behind."""

    def __init__(self, command: list[str], folder: Path) -> None:
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, cwd=folder
        )
        self._folder, self._next, self._inbox = folder, 0, Queue[Json]()
        self._findings: dict[str, list[Json]] = {}
        threading.Thread(target=self._listen, daemon=True).start()

    def __enter__(self) -> LanguageServer:
        try:
            root = self._folder.as_uri()
            folders = [{"uri": root, "name": "models"}]
            asks = {"workspace": {"configuration": True}, "textDocument": {"hover": {"contentFormat": ["markdown"]}}}
            self.ask("initialize", processId=None, rootUri=root, workspaceFolders=folders, capabilities=asks)
            self._send("initialized", {})
            self._send("workspace/didChangeConfiguration", {"settings": SETTINGS})
        except BaseException:
            self._process.kill()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.wait(PATIENCE)

    def open(self, path: Path, text: str) -> list[Json]:
        """Open a document, and wait for what is found in it."""
        document = {"uri": path.as_uri(), "languageId": "yaml", "version": 1, "text": text}
        self._findings.pop(path.as_uri(), None)
        self._send("textDocument/didOpen", {"textDocument": document})
        while path.as_uri() not in self._findings:
            self._handle(self._receive())
        return self._findings[path.as_uri()]

    def at(self, method: str, path: Path, line: int, column: int) -> Any:
        """Ask about a place in a document, counted from 0."""
        return self.ask(
            f"textDocument/{method}",
            textDocument={"uri": path.as_uri()},
            position={"line": line, "character": column},
        )

    def ask(self, method: str, **parameters: Any) -> Any:
        """Send a request and wait for its answer; requests of the server's own are answered meanwhile."""
        self._next += 1
        wanted = self._next
        self._send(method, parameters, id=wanted)
        while True:
            message = self._receive()
            if message.get("id") == wanted and "method" not in message:
                assert "error" not in message, message["error"]
                return message["result"]
            self._handle(message)

    def _handle(self, message: Json) -> None:
        method = message.get("method")
        if method == "textDocument/publishDiagnostics":
            self._findings[message["params"]["uri"]] = message["params"]["diagnostics"]
        elif method == "workspace/configuration":
            items = message["params"]["items"]
            self._answer(message, [SETTINGS.get(item.get("section", ""), {}) for item in items])
        elif "id" in message and method is not None:
            self._answer(message, None)

    def _answer(self, message: Json, result: Any) -> None:
        self._write({"jsonrpc": "2.0", "id": message["id"], "result": result})

    def _send(self, method: str, parameters: Json, **more: int) -> None:
        self._write({"jsonrpc": "2.0", "method": method, "params": parameters, **more})

    def _write(self, message: Json) -> None:
        body = json.dumps(message).encode()
        assert self._process.stdin is not None
        self._process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        self._process.stdin.flush()

    def _receive(self) -> Json:
        try:
            return self._inbox.get(timeout=PATIENCE)
        except Empty:
            raise TimeoutError(f"the language server has said nothing for {PATIENCE:g} s") from None

    def _listen(self) -> None:
        """Read messages for as long as there are any; runs in a thread of its own."""
        stream = self._process.stdout
        assert stream is not None
        while header := stream.readline():
            size = 0
            while header.strip():
                name, _, value = header.partition(b":")
                size = int(value) if name.lower() == b"content-length" else size
                header = stream.readline()
            self._inbox.put(json.loads(stream.read(size)))
