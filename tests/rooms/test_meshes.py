from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from clearway.rooms import meshes

CUP = ((0, 0), (0.1, 0), (0.12, 0.2), (0.1, 0.2), (0.08, 0.03), (0, 0.03))
SOLIDS = {
    "plain box": meshes.bevelled_box((1.0, 0.5, 0.3), 0.02, 0),
    "chamfered box": meshes.bevelled_box((1.0, 0.5, 0.3), 0.02, 1),
    "rounded box": meshes.bevelled_box((1.0, 0.5, 0.3), 0.1, 3),
    "thin box": meshes.bevelled_box((1.0, 0.5, 0.01), 0.1, 1),
    "cylinder": meshes.lathe(((0, 0), (0.2, 0), (0.2, 0.5), (0, 0.5)), 16),
    "cup": meshes.lathe(CUP, 16),
    "panel": meshes.panel(0.6, 0.4),
}


def welded(mesh: meshes.Mesh) -> np.ndarray:
    """Faces on the distinct places of the vertices, without those that weld to a line."""
    _, place = np.unique(np.round(mesh.vertices_m, 6), axis=0, return_inverse=True)
    faces = place.reshape(-1)[mesh.faces]
    flat = (faces[:, 0] == faces[:, 1]) | (faces[:, 1] == faces[:, 2]) | (faces[:, 0] == faces[:, 2])
    return faces[~flat]


def volume(mesh: meshes.Mesh) -> float:
    a, b, c = (mesh.vertices_m[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_are_closed_and_wind_outwards(name):
    mesh = SOLIDS[name]
    edges = Counter(pair for a, b, c in welded(mesh) for pair in ((a, b), (b, c), (c, a)))
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)
    assert volume(mesh) > 0


@pytest.mark.parametrize("name", SOLIDS)
def test_normals_are_unit_vectors_that_agree_with_the_winding(name):
    mesh = SOLIDS[name]
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1)
    a, b, c = (mesh.vertices_m[mesh.faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    if name != "panel":  # the back of a panel shares the normals of its front
        assert np.all(np.einsum("ij,ij->i", across, mesh.normals[mesh.faces].sum(axis=1)) > 0)


def test_a_box_has_its_size_and_a_known_volume():
    assert np.allclose(SOLIDS["plain box"].half_extents_m, [0.5, 0.25, 0.15])
    assert np.allclose(SOLIDS["rounded box"].half_extents_m, [0.5, 0.25, 0.15])
    assert volume(SOLIDS["plain box"]) == pytest.approx(0.15)
    assert len(SOLIDS["plain box"].faces) == 12
    assert len(SOLIDS["chamfered box"].faces) == 44


def test_a_lathe_of_many_slices_has_the_volume_of_a_cylinder():
    fine = meshes.lathe(((0, 0), (0.2, 0), (0.2, 0.5), (0, 0.5)), 400)
    assert volume(fine) == pytest.approx(np.pi * 0.2**2 * 0.5, rel=1e-3)


def test_uvs_are_metres_and_u_runs_along_the_longer_side():
    board = meshes.bevelled_box((0.1, 0.02, 2.0), 0.0, 0)
    front = np.abs(board.normals[:, 1]) == 1
    assert np.ptp(board.uvs[front, 0]) == pytest.approx(2.0)
    assert np.ptp(board.uvs[front, 1]) == pytest.approx(0.1)
    upright = meshes.bevelled_box((0.1, 0.02, 2.0), 0.0, 0, True)
    assert np.ptp(upright.uvs[front, 1]) == pytest.approx(2.0)
    tin = meshes.lathe(((0.2, 0), (0.2, 0.5)), 8)
    assert np.ptp(tin.uvs, axis=0) == pytest.approx([2 * np.pi * 0.2, 0.5])


def test_a_panel_shows_its_picture_upright_to_a_viewer_in_front():
    panel = meshes.panel(2.0, 1.0)
    top_left = np.argmin(np.linalg.norm(panel.uvs - [0, 1], axis=1))
    assert panel.vertices_m[top_left] == pytest.approx([1.0, 0.0, 0.5])  # the viewer at +y has +x on the left


def test_every_mesh_is_symmetric_in_x():
    for mesh in (*SOLIDS.values(), meshes.curtain(0.4, 1.0, 3)):
        places = np.unique(np.round(mesh.vertices_m, 5) + 0.0, axis=0)
        mirrored = np.unique(np.round(mesh.vertices_m * [-1, 1, 1], 5) + 0.0, axis=0)
        assert np.allclose(places, mirrored, atol=2e-5)


def test_a_curtain_is_seen_from_both_sides():
    cloth = meshes.curtain(0.4, 1.0, 4)
    assert (cloth.normals[:, 1] < 0).sum() == (cloth.normals[:, 1] > 0).sum() > 0
    assert np.allclose(np.linalg.norm(cloth.normals, axis=1), 1)
