"""The network of the encoder `clearway`: tokens of a picture, and what they tell of one picture or of two.

Two pictures are compared by correspondences: every token of the first one looks for the token of the second that sees
the same place, or for none; where it is found, and how deep both are, says how the cameras stand to each other.

Axes: B pictures, P pairs, T tokens, C numbers a token.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from clearway.perception.around import PLACES_M
from clearway.perception.token_grid import TokenGrid
from clearway.perception.whereabouts import WHEREABOUTS

DIRECTIONS = 4  # ahead, left, right, behind
GIST = 64  # numbers of a whole picture that two are compared by
SHARPNESS = 10.0  # of matches, before it is learnt
COUNTED = ("whereabouts_seen", "stood")  # buffers, how often what was learnt from was so
NEAREST_M = 0.1  # added to distances before their logarithm


@dataclass(frozen=True)
class EyesShape:
    """Sizes of the network; the defaults are those of the shipped one.

    Attributes:
        widths: channels at a quarter, an eighth and a sixteenth of the picture's height and width.
        token_width: C.
        description_width: of the description of a picture.
        hidden_width: of the layers that tell distances and poses.
        height_px, width_px: of its pictures, 16 times the rows and columns of tokens.
    """

    widths: tuple[int, int, int] = (48, 96, 192)
    token_width: int = 64
    description_width: int = 128
    hidden_width: int = 256
    height_px: int = 96
    width_px: int = 128

    @property
    def grid(self) -> TokenGrid:
        """The tokens of a picture."""
        rows, columns = self.height_px // 16, self.width_px // 16
        return TokenGrid(rows, columns, aspect=self.width_px / self.height_px)

    @property
    def picture_px(self) -> tuple[int, int]:
        """Height and width of its pictures."""
        return self.height_px, self.width_px

    @property
    def feature_count(self) -> int:
        """F, of the encoder: the description, then the tokens."""
        return self.description_width + self.grid.count * self.token_width

    def to_json(self) -> dict[str, object]:
        """As JSON values."""
        return {key: list(v) if isinstance(v, tuple) else v for key, v in asdict(self).items()}


class Glance(NamedTuple):
    """What tokens tell of a picture.

    Attributes:
        description: (B, description_width) unit vectors, alike for pictures of one place.
        free: (B, 4) log(metres + 0.1) that the body could move ahead, left, right and behind.
        stands: (B, 63) logits: the body could stand at each of `around.PLACES_M`.
        depth: (B, T) log(metres) of what each token sees.
    """

    description: Tensor
    free: Tensor
    stands: Tensor
    depth: Tensor


class Comparison(NamedTuple):
    """What the tokens of two pictures tell of their cameras.

    Attributes:
        place_m: (P, 2), where the second camera stands: so far ahead of the first, so far to its right.
        turn: (P, 2), about cosine and sine of how far the second one is turned to the right.
        overlap: (P,) logit: the share of the first one's tokens whose places the second one sees is a quarter or more.
        matches: (P, T, T + 1) logits: token of the second picture that sees what each of the first one's sees; the last
            says that none does.
        vector: (P, hidden_width), what the poses are told from.
        whereabouts: (P, 2313) logits: the second camera's pose is in each of the bins of `whereabouts`.
    """

    place_m: Tensor
    turn: Tensor
    overlap: Tensor
    matches: Tensor
    vector: Tensor
    whereabouts: Tensor


class Eyes(nn.Module):
    """Called with pictures (B, 3, height_px, width_px), standardised, it gives their tokens (B, T, C)."""

    slopes: Tensor
    whereabouts_seen: Tensor
    stood: Tensor

    def __init__(self, shape: EyesShape) -> None:
        super().__init__()
        self.shape = shape
        first, second, third = shape.widths
        count, width = shape.grid.count, shape.token_width
        self.trunk = nn.Sequential(
            _convolution(3, first, kernel=5, stride=4),
            _Residual(first),
            _convolution(first, second, stride=2),
            _Residual(second),
            _convolution(second, third, stride=2),
            _Residual(third),
            _Residual(third),
            nn.Conv2d(third, width, 1),
        )
        self.description = nn.Linear(count * width, shape.description_width)
        self.around = nn.Sequential(nn.Linear(count * width, shape.hidden_width // 2), nn.ReLU())
        self.free = nn.Linear(shape.hidden_width // 2, DIRECTIONS)
        self.stands = nn.Linear(shape.hidden_width // 2, len(PLACES_M))
        self.depth = nn.Linear(width, 1)
        self.asking, self.asked = nn.Linear(width, width), nn.Linear(width, width)
        self.no_match = nn.Parameter(torch.zeros(1))
        self.sharpness = nn.Parameter(torch.zeros(1))
        self.register_buffer("slopes", torch.tensor(shape.grid.slopes, dtype=torch.float32), persistent=False)
        self.gist = nn.Linear(count * width, GIST)
        self.pose = nn.Sequential(
            nn.Linear(count * 7 + 2 * GIST, shape.hidden_width),
            nn.ReLU(),
            nn.Linear(shape.hidden_width, shape.hidden_width),
            nn.ReLU(),
        )
        self.told = nn.Linear(shape.hidden_width, 5)
        self.whereabouts = nn.Linear(shape.hidden_width, WHEREABOUTS)
        self.register_buffer("whereabouts_seen", torch.ones(WHEREABOUTS))
        self.register_buffer("stood", torch.ones(len(PLACES_M) + 1))  # at each place, and of so many pictures
        for parameter in self.trunk.parameters():
            if parameter.ndim == 4:  # pictures come with their colours last
                parameter.data = parameter.data.contiguous(memory_format=torch.channels_last)

    def teach_on(self, before: Eyes) -> None:
        """Begin as eyes of the same shape are, whose features stay as they are; what they have counted is forgotten."""
        counted = {name: tensor for name, tensor in self.state_dict().items() if name in COUNTED}
        self.load_state_dict({**before.state_dict(), **counted})
        for part in (self.trunk, self.description):
            part.requires_grad_(False)

    def forward(self, pixels: Tensor) -> Tensor:
        """Tokens (B, T, C)."""
        return self.trunk(pixels).flatten(2).transpose(1, 2)

    def glance(self, tokens: Tensor) -> Glance:
        """What tokens (B, T, C) tell of each picture."""
        flat = tokens.flatten(1)
        description = functional.normalize(self.description(flat).float(), dim=1)
        around = self.around(flat)
        depth = self.depth(tokens)[..., 0].float()
        return Glance(description, self.free(around).float(), self.stands(around).float(), depth)

    def count(self, where: Tensor, stands: Tensor) -> None:
        """Keep how often what it has learnt from was so: bins (P,) int64 of pairs, and places to stand (B, 63) bool."""
        self.whereabouts_seen += torch.bincount(where, minlength=WHEREABOUTS).to(self.whereabouts_seen.device)
        self.stood += torch.cat([stands.sum(dim=0), torch.tensor([len(stands)])]).to(self.stood.device)

    def compare(self, first: Tensor, second: Tensor, first_depth: Tensor, second_depth: Tensor) -> Comparison:
        """What tokens (P, T, C) of two pictures, and their depth (P, T) as `glance` tells it, tell of the cameras."""
        asking = functional.normalize(self.asking(first).float(), dim=2)
        asked = functional.normalize(self.asked(second).float(), dim=2)
        alike = asking @ asked.transpose(1, 2) * (SHARPNESS * self.sharpness.exp())
        nothing = (SHARPNESS * self.no_match).expand(*alike.shape[:2], 1)
        matches = torch.cat([alike, nothing], dim=2)
        shares = matches.softmax(dim=2)[..., :-1]  # (P, T, T)
        found = shares.sum(dim=2, keepdim=True)
        where = shares / found.clamp_min(1e-6)
        seen = [
            where @ self.slopes * found,
            found,
            first_depth.unsqueeze(2),
            where @ second_depth.unsqueeze(2) * found,
            where.amax(dim=2, keepdim=True),
            second_depth.unsqueeze(2),
        ]
        gists = [self.gist(tokens.flatten(1)).float() for tokens in (first, second)]
        vector = self.pose(torch.cat([torch.cat(seen, dim=2).flatten(1), *gists], dim=1))
        told = self.told(vector)
        return Comparison(told[:, :2], told[:, 2:4], told[:, 4], matches, vector, self.whereabouts(vector))


class _Residual(nn.Module):
    """Two convolutions beside a shortcut."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.inner = nn.Sequential(
            _convolution(width, width), nn.Conv2d(width, width, 3, padding=1, bias=False), nn.BatchNorm2d(width)
        )

    def forward(self, x: Tensor) -> Tensor:
        return functional.relu(x + self.inner(x))


def _convolution(inputs: int, outputs: int, *, kernel: int = 3, stride: int = 1) -> nn.Sequential:
    convolution = nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, bias=False)
    return nn.Sequential(convolution, nn.BatchNorm2d(outputs), nn.ReLU())
