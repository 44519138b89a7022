"""Encoders: pictures into frozen features. `encode_scenes` does it for whole scenes, cached by content."""

from clearway.perception.encode import check_encoder, encode_scenes, encoder_from_record
from clearway.perception.encoder import Encoder

__all__ = ["Encoder", "check_encoder", "encode_scenes", "encoder_from_record"]
