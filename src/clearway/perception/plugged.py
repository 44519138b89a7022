"""Encoders of other packages (`clearway.plugins`), behind the checks that ours need not fear.

An entry point of the group `clearway.encoders` is called without arguments, and what it gives has

    identity: str, another one whenever the features change; scenes trained together must agree in it
    feature_count: int, F
    encode(pictures): features (B, F) of pictures (B, height, width, 3) uint8; equal for equal pictures

A record of such an encoder names its plugin and package, so that the encoder can be made again wherever that is
installed.
"""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral
from typing import Any

import numpy as np

from clearway.errors import EncoderError, PluginError
from clearway.perception.encoder import identity_of
from clearway.plugins import Plugin, find_plugin, load_plugin
from clearway.scenes.scene import EncoderRecord

KIND = "plugin"


@dataclass(frozen=True)
class PluginEncoder:
    """An encoder of another package.

    Attributes:
        record: what the encoder is.
        feature_count: F.
        made: what the plugin gave.
    """

    record: EncoderRecord
    feature_count: int
    made: Any

    def encode(self, pictures: np.ndarray) -> np.ndarray:
        """Features (B, F) float32 of pictures (B, height, width, 3) uint8.

        Raises:
            EncoderError: what the plugin returned is of another shape or type, or holds NaN or Inf.
        """
        features = np.asarray(self.made.encode(pictures))
        expected = (len(pictures), self.feature_count)
        if features.shape != expected or features.dtype.kind not in "fiu":
            found = f"{features.dtype} {features.shape}, expected floats {expected}"
            raise EncoderError(f"encoder {self.record.name}: returned {found}. Ask its authors, or use another encoder")
        if not np.isfinite(features).all():
            raise EncoderError(f"encoder {self.record.name} made NaN or Inf of a picture. Use another encoder")
        return np.ascontiguousarray(features, dtype=np.float32)


def make_encoder(plugin: Plugin) -> PluginEncoder:
    """The encoder that a plugin makes.

    Raises:
        PluginError: it cannot be imported or made, or lacks one of the parts above.
    """
    make = load_plugin(plugin)
    remedy = f"Ask its authors, or uninstall {plugin.package}"
    try:
        made: Any = make()  # type: ignore[operator]
    except Exception as fault:  # another's code, as in load_plugin
        reason = f"{type(fault).__name__}: {' '.join(str(fault).split())[:200]}"
        raise PluginError(f"{plugin}: cannot be made ({reason}). {remedy}") from fault
    identity, count = getattr(made, "identity", None), getattr(made, "feature_count", None)
    if not isinstance(identity, str) or not identity:
        raise PluginError(f"{plugin}: its identity is {identity!r:.40}, expected a text. {remedy}")
    if not isinstance(count, Integral) or isinstance(count, bool) or int(count) < 1:
        raise PluginError(f"{plugin}: its feature_count is {count!r:.40}, expected a whole number from 1 on. {remedy}")
    if not callable(getattr(made, "encode", None)):
        raise PluginError(f"{plugin}: has no method encode. {remedy}")
    fixed = {"kind": KIND, "plugin": plugin.name, "package": plugin.package, "made_of": identity}
    settings = {**fixed, "version": plugin.version}
    return PluginEncoder(EncoderRecord(plugin.name, identity_of(fixed, ()), settings), int(count), made)


def from_record(record: EncoderRecord) -> PluginEncoder:
    """Make the encoder again that a record names.

    Raises:
        EncoderError: its package is not installed, or the encoder is another than the record's.
        PluginError: it cannot be imported or made.
    """
    name, package = str(record.settings.get("plugin")), str(record.settings.get("package"))
    plugin = find_plugin("encoders", name)
    if plugin is None:
        problem = f"encoder {name}: the package {package} that offers it is not installed"
        raise EncoderError(f"{problem}. Install it, or encode the scene again with another encoder")
    encoder = make_encoder(plugin)
    if encoder.record.identity != record.identity:
        made_by = f"{package} {record.settings.get('version')} ({record.settings.get('made_of')})"
        found = f"{plugin.package} {plugin.version} ({encoder.record.settings['made_of']})"
        problem = f"encoder {name}: is that of {found}, the features were made by that of {made_by}"
        raise EncoderError(f"{problem}. Install that version, or encode the scene again")
    return encoder
