"""Minibatches: every row once, what repeats once, and the same gradients as row by row."""

import copy

import pytest
import torch

from clearway.learn.losses import Batch, LossSettings, loss_gradient
from clearway.learn.minibatches import Deck, Minibatch, dealt_epochs
from clearway.learn.presets import DEFAULT
from helpers.small_runs import small_learner, small_trainer

STATES, TARGETS = 20, 4  # scenes of 12 and 8 states
ROWS_PER_SCENE = (40, 25)


def made_batch(seed: int = 0, lowest: int = 0) -> Batch:
    """Rows whose histories and targets repeat; `action` numbers them."""
    rng = torch.Generator().manual_seed(seed)
    parts = []
    for first, last, count, targets in ((lowest, 12, 40, (0, 1)), (12, 20, 25, (2, 3))):
        kinds = torch.randint(first, last, (7, 3), generator=rng)
        history = kinds[torch.randint(7, (count,), generator=rng)]
        parts.append((history, torch.tensor(targets)[torch.randint(2, (count,), generator=rng)]))
    history, target = (torch.cat(column) for column in zip(*parts, strict=True))
    number = torch.arange(len(target))
    return Batch(history, target, number, number / 10, number / 20, number / 30, ROWS_PER_SCENE)


def dealt(batch: Batch, parts: int = 3, seed: int = 0, row_step: int = 1) -> list[Minibatch]:
    return Deck(batch, STATES, TARGETS, row_step).dealt(parts, torch.Generator().manual_seed(seed))


def test_every_row_is_dealt_once_and_stays_whole() -> None:
    batch = made_batch()
    parts = dealt(batch)
    assert sorted(torch.cat([part.rows.action for part in parts]).tolist()) == list(range(len(batch)))
    for part in parts:
        number = part.rows.action
        assert torch.equal(part.rows.history, batch.history[number])
        assert torch.equal(part.rows.target, batch.target[number])
        assert torch.equal(part.rows.value_target, batch.value_target[number])


def test_what_repeats_is_there_once() -> None:
    for part in dealt(made_batch()):
        assert torch.equal(part.by_row(part.target), part.rows.target)
        assert torch.equal(part.history[part.history_of][part.pair_of], part.rows.history)
        assert len(part.history.unique(dim=0)) == len(part.history)
        pairs = torch.cat([part.history[part.history_of], part.target[:, None]], 1)
        assert len(pairs.unique(dim=0)) == len(pairs)
        assert (part.pair_count, part.history_count) == (len(pairs), len(part.history))


def test_round_numbers_of_pairs_and_histories_hold_the_same() -> None:
    for part, plain in zip(dealt(made_batch(), row_step=8), dealt(made_batch()), strict=True):
        assert all(count % 8 == 0 for count in (*part.pairs_per_scene, len(part.history)))
        assert sum(part.pairs_per_scene) == len(part.target) == len(part.history_of)
        assert (part.pair_count, part.history_count) == (len(plain.target), len(plain.history))
        assert torch.equal(part.rows.action, plain.rows.action)
        assert torch.equal(part.by_row(part.target), part.rows.target)
        assert torch.equal(part.history[part.history_of][part.pair_of], part.rows.history)
        first = part.pairs_per_scene[0]
        assert (part.target[:first] < 2).all()
        assert (part.target[first:] >= 2).all()
        gradient = torch.rand(len(part.rows), 5, dtype=torch.float64) + 1
        by_pair = part.by_pair(gradient)
        assert torch.allclose(by_pair.sum(0), gradient.sum(0))
        assert int((by_pair.sum(1) > 0).sum()) == part.pair_count


@pytest.mark.parametrize("states", [2**20, 2**40, 2**50])
def test_more_kinds_of_histories_than_numbers_make_no_difference(states: int) -> None:
    """Keys of 3 poses and a target do not fit into 64 bits then."""
    batch = made_batch()
    for part, plain in zip(
        Deck(batch, states, TARGETS).dealt(3, torch.Generator()),
        Deck(batch, STATES, TARGETS).dealt(3, torch.Generator()),
        strict=True,
    ):
        assert torch.equal(part.rows.action, plain.rows.action)
        assert torch.equal(part.history, plain.history)
        assert torch.equal(part.target, plain.target)
        assert torch.equal(part.history_of, plain.history_of)
        assert torch.equal(part.pair_of, plain.pair_of)


def test_rows_of_one_history_are_learnt_from_together() -> None:
    parts = dealt(made_batch())
    histories = [{tuple(row) for row in part.history.tolist()} for part in parts]
    assert sum(map(len, histories)) == len(set.union(*histories))


def test_scenes_keep_their_order_and_are_dealt_out_evenly() -> None:
    for part in dealt(made_batch(), parts=3):
        first = part.rows.rows_per_scene[0]
        assert sum(part.rows.rows_per_scene) == len(part.rows)
        assert (part.rows.action[:first] < 40).all()
        assert (part.rows.action[first:] >= 40).all()
        first = part.pairs_per_scene[0]
        assert sum(part.pairs_per_scene) == len(part.target)
        assert (part.target[:first] < 2).all()
        assert (part.target[first:] >= 2).all()
        of_first_scene = int((part.history[:, -1] < 12).sum())
        assert 2 <= of_first_scene <= 3
        assert 2 <= len(part.history) - of_first_scene <= 3


def test_gradients_of_rows_add_up_by_pair() -> None:
    part = dealt(made_batch())[0]
    gradient = torch.randn(len(part.rows), 5, dtype=torch.float64)
    expected = torch.zeros(len(part.target), 5, dtype=torch.float64)
    for row, pair in enumerate(part.pair_of.tolist()):
        expected[pair] += gradient[row]
    assert torch.allclose(part.by_pair(gradient), expected)


def test_every_epoch_is_shuffled_anew() -> None:
    batch = made_batch()

    def contents(seed: int) -> list[list[list[int]]]:
        generator = torch.Generator().manual_seed(seed)
        epochs = dealt_epochs(batch, STATES, TARGETS, epochs=2, parts=3, row_step=1, generator=generator)
        return [[part.rows.action.tolist() for part in parts] for parts in epochs]

    first, second = contents(0)
    assert first != second
    assert contents(0) == [first, second] != contents(1)


def test_one_pass_over_everything_leaves_the_batch_as_it_is() -> None:
    batch = made_batch()
    [[part]] = dealt_epochs(batch, STATES, TARGETS, epochs=1, parts=1, row_step=8, generator=torch.Generator())
    assert part.rows is batch
    assert part.history is batch.history
    output = torch.randn(len(batch), 5)
    assert part.by_row(output) is output
    assert part.by_pair(output) is output


@pytest.mark.parametrize(("kinds", "parts"), [(1, 1), (2, 2), (3, 3), (9, 4)])
def test_no_minibatch_is_empty_where_few_histories_differ(kinds: int, parts: int) -> None:
    rows = torch.arange(30) % kinds
    batch = Batch(rows[:, None], rows * 0, rows, rows, rows, rows, (30, 0))
    found = dealt(batch, parts=4)
    assert len(found) == parts
    assert all(len(part.rows) for part in found)


@pytest.mark.parametrize("row_step", [1, 16])
def test_a_step_is_the_one_that_every_row_by_itself_would_make(row_step: int) -> None:
    exact = small_learner(DEFAULT, epochs=1, minibatches=2, hindsight=True, matmul_precision="highest")
    trainer = small_trainer(exact)
    rollout = trainer.collector.collect()
    batch, _ = trainer._batch(rollout, looks_ahead=True)
    batch = trainer._with_hindsight(rollout, batch)
    deck = Deck(batch, trainer.world.state_count, trainer.world.target_count, row_step)
    settings = LossSettings.after(0, trainer.learner)
    for part in deck.dealt(2, torch.Generator()):
        assert part.history_count < part.pair_count < len(part.rows)
        whole = Minibatch.whole(part.rows)
        gradients = []
        for shape in (part, whole):
            known = shape.history, shape.target, shape.pairs_per_scene
            kept = trainer.lookup.forward(*known, history_of=shape.history_of)
            loss, gradient = loss_gradient(shape.by_row(kept.output), part.rows, settings)
            trainer.lookup.batches = 0
            trainer.lookup.backward(*known, kept, shape.by_pair(gradient), shape.history_of)
            trainer.lookup.siamese_gradient()
            gradients.append((loss.total, copy.deepcopy([p.grad for p in trainer.network.parameters()])))
        (loss, together), (expected_loss, alone) = gradients
        assert torch.allclose(loss, expected_loss, atol=1e-7)
        for own, expected in zip(together, alone, strict=True):
            assert torch.allclose(own, expected, atol=1e-6 * float(expected.abs().max()))
