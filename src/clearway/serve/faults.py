"""What the service says when it refuses: a code for programs, a sentence for people, nothing internal."""

from __future__ import annotations

from http import HTTPStatus
from typing import Literal

from pydantic import BaseModel

Code = Literal[
    "unauthorised",
    "too_many_attempts",
    "not_found",
    "method_not_allowed",
    "invalid_request",
    "unsupported_picture",
    "unreadable_picture",
    "body_too_large",
    "picture_too_large",
    "no_target",
    "out_of_order",
    "no_such_session",
    "too_many_sessions",
    "overloaded",
    "too_slow",
    "deadline_passed",
    "internal",
]
STATUS: dict[Code, HTTPStatus] = {
    "unauthorised": HTTPStatus.UNAUTHORIZED,
    "too_many_attempts": HTTPStatus.TOO_MANY_REQUESTS,
    "not_found": HTTPStatus.NOT_FOUND,
    "method_not_allowed": HTTPStatus.METHOD_NOT_ALLOWED,
    "invalid_request": HTTPStatus.UNPROCESSABLE_ENTITY,
    "unsupported_picture": HTTPStatus.UNSUPPORTED_MEDIA_TYPE,
    "unreadable_picture": HTTPStatus.UNPROCESSABLE_ENTITY,
    "body_too_large": HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
    "picture_too_large": HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
    "no_target": HTTPStatus.CONFLICT,
    "out_of_order": HTTPStatus.CONFLICT,
    "no_such_session": HTTPStatus.NOT_FOUND,
    "too_many_sessions": HTTPStatus.TOO_MANY_REQUESTS,
    "overloaded": HTTPStatus.SERVICE_UNAVAILABLE,
    "too_slow": HTTPStatus.REQUEST_TIMEOUT,
    "deadline_passed": HTTPStatus.GATEWAY_TIMEOUT,
    "internal": HTTPStatus.INTERNAL_SERVER_ERROR,
}
POLICY, TOO_BIG, INTERNAL, AGAIN = 1008, 1009, 1011, 1013  # WebSocket close codes


class FaultDetail(BaseModel):
    """Why a request was refused."""

    code: Code
    message: str


class FaultBody(BaseModel):
    """The body of every refusal."""

    error: FaultDetail


class Fault(Exception):
    """A refusal.

    Args:
        code: what programs read.
        message: what people read: what was wrong and the remedy.
    """

    def __init__(self, code: Code, message: str) -> None:
        super().__init__(message)
        self.code, self.message, self.status = code, message, int(STATUS[code])

    def body(self) -> bytes:
        """As JSON."""
        return FaultBody(error=FaultDetail(code=self.code, message=self.message)).model_dump_json().encode()

    def headers(self) -> dict[str, str]:
        """That go with it."""
        extra = {"unauthorised": {"www-authenticate": "Bearer"}, "too_many_sessions": {"retry-after": "60"}}
        extra["too_many_attempts"] = {"retry-after": "60"}
        extra["overloaded"] = {"retry-after": "1"}
        return {"content-type": "application/json", **extra.get(self.code, {})}
