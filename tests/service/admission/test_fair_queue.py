"""Whose waiter is next."""

from __future__ import annotations

from service.admission.fair_queue import FairQueue, Holder, Waiter

from .gates import in_loop

A, B, C = b"a", b"b", b"c"


def anyone(_: Holder) -> bool:
    return True


def joined(queue: FairQueue, *holders: Holder) -> list[Waiter]:
    return [queue.join(holder, fixed=False) for holder in holders]


def ran(queue: FairQueue, holder: Holder, seconds: float) -> None:
    queue.started(holder)
    queue.finished(holder, seconds)


@in_loop
async def test_a_newcomer_starts_where_the_least_served_is() -> None:
    queue = FairQueue()
    queue.expect(A)
    ran(queue, A, 5.0)
    queue.expect(B)
    ran(queue, B, 1.0)
    # 5 s and 6 s: from nothing, B would have 1 s and be first for a long time.
    of_b, of_a = joined(queue, B, A)
    assert queue.next(anyone) is of_a
    assert queue.next(anyone) is of_b


@in_loop
async def test_old_use_is_forgotten_with_whoever_has_nothing_left() -> None:
    queue = FairQueue()
    queue.expect(A)
    queue.expect(B)
    ran(queue, A, 9.0)
    ran(queue, B, 1.0)
    assert queue.holders == 2
    queue.expect_no_longer(A)
    assert (queue.holders, queue.places_of(A), queue.places_of(B)) == (1, 0, 1)
    # A returns to the place of B, and the next after it is the holder that has been in front for longest.
    of_a, of_b = joined(queue, A, B)
    assert [queue.next(anyone), queue.next(anyone)] == [of_a, of_b]


@in_loop
async def test_each_holder_s_turns_come_in_order_and_nobody_waits_for_nothing() -> None:
    queue = FairQueue()
    assert queue.next(anyone) is None
    waiters = joined(queue, A, A, A)
    assert queue.waiting == 3
    assert [queue.next(anyone) for _ in range(4)] == [*waiters, None]
    assert (queue.waiting, queue.places_of(A)) == (0, 3)  # they run
    for _ in waiters:
        queue.finished(A, 1.0)
    assert (queue.holders, queue.places_of(A)) == (0, 0)


@in_loop
async def test_places_are_what_waits_runs_and_comes() -> None:
    queue = FairQueue()
    queue.expect(A)
    queue.started(A)
    (waiter,) = joined(queue, A)
    assert (queue.places_of(A), queue.holders, queue.waiting) == (3, 1, 1)
    queue.leave(A, waiter)
    assert (queue.places_of(A), queue.waiting) == (2, 0)
    queue.expect_no_longer(A)
    queue.finished(A, 0.0)
    assert (queue.places_of(A), queue.holders) == (0, 0)


@in_loop
async def test_the_greediest_gives_up_its_youngest() -> None:
    queue = FairQueue()
    first, *_, last = joined(queue, A, A, A)
    joined(queue, B, B)
    assert queue.take_from_the_greediest(3) is None  # no more than its share
    assert queue.take_from_the_greediest(2) is last
    assert (queue.waiting, queue.places_of(A)) == (4, 2)
    assert queue.take_from_the_greediest(1) is not None
    assert queue.next(anyone) is first


@in_loop
async def test_a_fixed_turn_is_never_taken() -> None:
    queue = FairQueue()
    fixed = [queue.join(A, fixed=True) for _ in range(3)]
    (loose,) = joined(queue, B)
    # Not A, which has the most places but none that could be taken.
    assert queue.take_from_the_greediest(0) is loose
    assert queue.take_from_the_greediest(0) is None
    queue.join(A, fixed=False)
    fixed.append(queue.join(A, fixed=True))
    taken = queue.take_from_the_greediest(1)
    assert taken is not None
    assert taken not in fixed
    assert [queue.next(anyone) for _ in range(4)] == fixed


@in_loop
async def test_a_holder_that_may_start_nothing_is_passed_over() -> None:
    queue = FairQueue()
    of_a, of_b = joined(queue, A, B)
    assert queue.next(lambda holder: holder != A) is of_b
    assert queue.next(lambda holder: holder != A) is None
    assert queue.next(anyone) is of_a


@in_loop
async def test_what_runs_on_without_a_slot_keeps_its_place_and_costs_the_time_in_the_slot() -> None:
    queue = FairQueue()
    queue.started(A)
    queue.started(B)
    queue.spent(A, 2.0)
    queue.spent(B, 1.0)
    assert queue.places_of(A) == 1
    of_a, of_b = joined(queue, A, B)
    assert queue.next(anyone) is of_b
    queue.finished(A, 0.0)
    assert queue.next(anyone) is of_a
