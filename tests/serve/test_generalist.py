"""The service with the agent for any room."""

from __future__ import annotations

import numpy as np

import clearway
from clearway.serve.client import Client
from clearway.serve.limits import Limits
from clearway.serve.service import Service
from clearway.serve.sessions import state_bytes
from helpers.one_file import OneFile
from helpers.serving import TOKEN, TOKENS, picture_bytes

PNG = {"content-type": "image/png"}


def test_it_walks_as_a_navigator_does_and_says_whether_it_has_arrived(called, tmp_path) -> None:
    agent = OneFile(tmp_path).torch
    pictures = np.random.default_rng(0).integers(0, 256, (6, 12, 16, 3)).astype(np.uint8)
    client, navigator = Client("http://testserver", TOKEN), clearway.Navigator(agent)
    client._http.close()
    client._http = called(Service(agent, Limits(), TOKENS))
    assert client.agent()["scene"] == "any room"
    with client.session() as session:
        for mover in (session, navigator):
            mover.set_target(pictures[2])
        for picture in pictures:
            assert session.act(picture) == navigator.act(picture)
            assert session.arrived is navigator.arrived is not None
    refused = client._http.post("/sessions", json={"selection": "argmax"})
    assert refused.status_code == 422 and "draws nothing" in refused.json()["error"]["message"]
    opened = client._http.post("/sessions", json={}).json()["session_id"]
    wide = picture_bytes(np.zeros((9, 16, 3), np.uint8))
    refused = client._http.put(f"/sessions/{opened}/target", content=wide, headers=PNG)
    assert refused.status_code == 415 and "Crop them to 12 x 9" in refused.json()["error"]["message"]


def test_what_a_session_keeps_is_known_before_it_walks(tmp_path) -> None:
    agent = OneFile(tmp_path).torch
    seen = {"rgb": np.zeros((1, 48, 64, 3), np.uint8)}
    state = agent.act(seen, agent.reset(seen, np.zeros(1, np.int64)))[1]
    assert state_bytes(agent) == sum(values.nbytes for values in state.values()) > 4 * 21 * 21 * 8
