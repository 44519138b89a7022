"""Encoders of a user's own and of other packages (`clearway.plugins`), behind checks of what they return.

Such an encoder, and what an entry point of the group `clearway.encoders` gives when called without arguments, has

    identity: str, another one whenever the features change; scenes trained together must agree in it
    feature_count: int, F
    encode(pictures): features (B, F) of pictures (B, height, width, 3) uint8; equal for equal pictures
    sensor: str, where it takes those of another sensor than the colour camera, such as "depth"

and, where it takes other pictures than the colour camera's, `sensor`: "depth" for (B, height, width) float32 metres
(`clearway.scenes.sensors`).

The record of a package's encoder names plugin and package, so that it can be made again wherever that is installed.
That of a program's own cannot say how: its scenes can be trained on, but new pictures cannot be encoded by them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Integral
from typing import Any

import numpy as np

from clearway.errors import EncoderError, PluginError, kind_and_reason
from clearway.perception.encoder import SENSOR, identity_of
from clearway.plugins import Plugin, find_plugin, load_plugin
from clearway.scenes.scene import EncoderRecord
from clearway.scenes.sensors import DEPTH, RGB

KIND, OWN_KIND = "plugin", "own"


@dataclass(frozen=True)
class CheckedEncoder:
    """An encoder that is not ours.

    Attributes:
        record: what the encoder is.
        feature_count: F.
        made: what the plugin gave, or the user.
    """

    record: EncoderRecord
    feature_count: int
    made: Any

    def encode(self, pictures: np.ndarray) -> np.ndarray:
        """Features (B, F) float32 of its sensor's pictures (B, ...), for example (B, height, width, 3) uint8.

        Raises:
            EncoderError: it fails, or what it returned is of another shape or type, or holds NaN or Inf, in float32.
        """
        try:
            features = np.asarray(self.made.encode(pictures))
        except (Exception, SystemExit) as fault:  # another's code: anything can come of it; the user is told whose
            reason = kind_and_reason(fault)
            raise EncoderError(f"encoder {self.record.name}: failed ({reason}). Mend it, or use another") from fault
        expected = (len(pictures), self.feature_count)
        if features.shape != expected or features.dtype.kind not in "fiu":
            found = f"{features.dtype} {features.shape}, expected floats {expected}"
            raise EncoderError(f"encoder {self.record.name}: returned {found}. Mend it, or use another encoder")
        with np.errstate(over="ignore"):
            kept = np.ascontiguousarray(features, dtype=np.float32)
        if not np.isfinite(kept).all():
            problem = f"encoder {self.record.name} made NaN or Inf of a picture, in float32"
            raise EncoderError(f"{problem}. Use another encoder")
        return kept


def make_encoder(plugin: Plugin) -> CheckedEncoder:
    """The encoder that a plugin makes.

    Raises:
        PluginError: it cannot be imported or made, or lacks one of the parts above.
    """
    make = load_plugin(plugin)
    remedy = f"Ask its authors, or uninstall {plugin.package}"
    try:
        made: Any = make()  # type: ignore[operator]
    except (Exception, SystemExit) as fault:  # another's code, as in load_plugin
        reason = kind_and_reason(fault)
        raise PluginError(f"{plugin}: cannot be made ({reason}). {remedy}") from fault
    fixed: dict[str, object] = {"kind": KIND, "plugin": plugin.name, "package": plugin.package}
    return _checked(made, plugin.name, fixed, {"version": plugin.version}, str(plugin), remedy)


def own_encoder(made: Any) -> CheckedEncoder:
    """An encoder of the user's own; its name is its attribute `name` where it has one, else its class's.

    Raises:
        EncoderError: it lacks one of the parts above.
    """
    name = getattr(made, "name", type(made).__name__)
    try:
        return _checked(made, str(name), {"kind": OWN_KIND}, {}, f"encoder {name}", "Give it one")
    except PluginError as fault:
        raise EncoderError(str(fault)) from fault


def _checked(
    made: Any, name: str, fixed: Mapping[str, object], told: Mapping[str, object], what: str, remedy: str
) -> CheckedEncoder:
    """The encoder, if it has all parts; `told` is kept in its record but is no part of its identity."""
    identity, count = getattr(made, "identity", None), getattr(made, "feature_count", None)
    if not isinstance(identity, str) or not identity:
        raise PluginError(f"{what}: its identity is {identity!r:.40}, expected a text. {remedy}")
    if not isinstance(count, Integral) or isinstance(count, bool) or int(count) < 1:
        raise PluginError(f"{what}: its feature_count is {count!r:.40}, expected a whole number from 1 on. {remedy}")
    if not callable(getattr(made, "encode", None)):
        raise PluginError(f"{what}: has no method encode. {remedy}")
    sensor = getattr(made, "sensor", RGB)
    if not isinstance(sensor, str) or not sensor:
        raise PluginError(f"{what}: its sensor is {sensor!r:.40}, expected a name such as '{DEPTH}'. {remedy}")
    fixed = {**fixed, "made_of": identity, **({} if sensor == RGB else {SENSOR: sensor})}
    return CheckedEncoder(EncoderRecord(name, identity_of(fixed, ()), {**fixed, **told}), int(count), made)


def from_record(record: EncoderRecord) -> CheckedEncoder:
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
