"""The service keeps what its OpenAPI document says, whatever is sent to it."""

import asyncio
from dataclasses import replace

import numpy as np
import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, settings

from clearway.deploy.agent import MAX_PICTURE_SIDE
from clearway.serve.app import make_app
from clearway.serve.decoders import Decoders
from clearway.serve.decoding import Bounds, Refused, decoded
from clearway.serve.faults import Fault
from clearway.serve.limits import Limits
from clearway.serve.protection import protected
from clearway.serve.service import Service
from helpers.serving import OWNER, TOKEN, TOKENS, grey
from helpers.sums import Sums

HEADERS = {"Authorization": f"Bearer {TOKEN}"}
LIMITS = Limits(sessions=5000, body_bytes=20_000, idle_s=86_400.0, wrong_tokens=10**9)


class Here(Decoders):
    """Decodes in this process: schemathesis starts and ends the application for every request."""

    def start(self) -> None:
        pass

    async def decode(self, content, owner, standing):
        try:
            return np.asarray(decoded(content, Bounds(LIMITS.picture_pixels, MAX_PICTURE_SIDE, LIMITS.picture_scans)))
        except Refused as refusal:
            raise Fault(refusal.code, refusal.message) from refusal


AGENT = Sums()
AGENT.card = replace(AGENT.card, picture_size=None)  # the document cannot say which aspect an agent's pictures have
SERVICE = Service(AGENT, LIMITS, TOKENS)
SERVICE.decoders = Here(LIMITS)
APP = protected(make_app(SERVICE), SERVICE)
SCHEMA = schemathesis.openapi.from_asgi("/openapi.json", APP, headers=HEADERS)
KNOWN = asyncio.run(SERVICE.sessions.open(OWNER, "sampled", 0))
SUPPRESSED = list(HealthCheck)


def answered_as_documented(case) -> bool:
    """The answer has a documented status, kind and body; otherwise schemathesis raises what is wrong with it."""
    if "session_id" in case.path_parameters and case.method != "DELETE" and case.meta.generation.mode.is_positive:
        case.path_parameters["session_id"] = KNOWN.id  # else no request would get past the session's name
    response = case.call_and_validate(headers=HEADERS)
    documented = SCHEMA.raw_schema["paths"][case.path].get(case.method.lower(), {"responses": ["405"]})
    return str(response.status_code) in documented["responses"]


@SCHEMA.parametrize()
@settings(max_examples=15, deadline=None, suppress_health_check=SUPPRESSED, phases=[Phase.explicit, Phase.generate])
def test_any_request_is_answered_as_documented(case) -> None:
    assert answered_as_documented(case)


@pytest.mark.slow
@SCHEMA.parametrize()
@settings(max_examples=100, deadline=None, suppress_health_check=SUPPRESSED)
def test_many_requests_are_answered_as_documented(case) -> None:
    assert answered_as_documented(case)


def test_the_document_names_every_route_and_the_token() -> None:
    document = SCHEMA.raw_schema
    assert document["paths"].keys() == {
        "/health",
        "/ready",
        "/metrics",
        "/agent",
        "/sessions",
        "/sessions/{session_id}",
        "/sessions/{session_id}/target",
        "/sessions/{session_id}/steps",
    }
    assert document["components"]["securitySchemes"] == {"HTTPBearer": {"type": "http", "scheme": "bearer"}}
    steps = document["paths"]["/sessions/{session_id}/steps"]["post"]
    assert steps["requestBody"]["content"].keys() == {"image/jpeg", "image/png", "image/webp"}
    assert {"200", "401", "404", "408", "409", "413", "415", "422", "500", "503", "504"} <= steps["responses"].keys()
    assert "security" not in document["paths"]["/health"]["get"]


def test_a_picture_passes_the_checks_too() -> None:
    case = SCHEMA["/sessions/{session_id}/target"]["PUT"].Case(
        path_parameters={"session_id": KNOWN.id}, body=grey(3), media_type="image/png"
    )
    assert case.call_and_validate(headers=HEADERS).status_code == 204
