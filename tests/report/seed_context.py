"""Put RO-Crate's JSON-LD context, as the package rocrate carries it, into the cache of the validator of crates.

So that it validates without a network.  Run by the Python that the validator is installed for, with the cache's path.
"""

import io
import sys
from importlib.resources import files

from requests import Response
from requests.adapters import BaseAdapter
from requests_cache import CachedSession
from urllib3 import HTTPResponse

CONTEXT = "https://w3id.org/ro/crate/1.1/context"


class Packaged(BaseAdapter):
    """Answers in place of the network."""

    def send(self, request, **_) -> Response:
        answer = Response()
        answer.status_code, answer.url, answer.request = 200, request.url, request
        answer.headers["Content-Type"] = "application/ld+json"
        content = (files("rocrate") / "data" / "ro-crate.jsonld").read_bytes()
        answer.raw = HTTPResponse(io.BytesIO(content), answer.headers, preload_content=False)
        return answer

    def close(self) -> None:
        pass


session = CachedSession(sys.argv[1], backend="sqlite", expire_after=-1)
session.mount(CONTEXT, Packaged())
assert session.get(CONTEXT).json()["@id"] == CONTEXT, "this version of rocrate carries another context"
assert session.get(CONTEXT).from_cache
