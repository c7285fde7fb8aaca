"""The compiled stepper as a function of a state, and the same in plain numpy to check it."""

import numpy as np

from rftfit.forces import reference_kernel
from rftfit.model import kernel

NOTHING = np.empty((0, 0))


def step(profile, parts, state, turn, rate, step_s, steps, rk4=False, every=0, samples=NOTHING):
    """State after some steps."""
    state = np.array(state, dtype=float)
    kernel.advance(
        profile.pack,
        parts.bodies,
        parts.widths_cm,
        parts.group,
        parts.hips,
        parts.inertia,
        state,
        turn,
        rate,
        step_s,
        steps,
        rk4,
        every,
        samples,
    )
    return state


def forces(profile, parts, state, turn, rate):
    """Force z, x on every element of each group, and where it acts: shape (members, n, 4)."""
    placed = parts.place(state, turn, rate)
    return [reference_kernel.element_forces(profile, elements) for elements in placed]


def net(profile, parts, state, turn, rate):
    """Force z, x and moment about the centre of mass."""
    force_rows = [elements.reshape(-1, 4) for elements in forces(profile, parts, state, turn, rate)]
    return reference_kernel.net(np.concatenate(force_rows), state[0], state[1])


def plain_steps(profile, parts, state, turn, rate, step_s, steps, rk4=False):
    """States before the first step and after each, shape (steps + 1, 6)."""

    def slope(now, turn_now):
        force_z, force_x, moment = net(profile, parts, now, turn_now, rate)
        per_newton, per_newton_cm, gravity = parts.inertia
        return np.array(
            [*now[3:], force_x * per_newton, force_z * per_newton - gravity, moment * per_newton_cm]
        )

    path = [np.asarray(state)]
    for k in range(steps):
        now, turn_now = path[-1], turn + rate * step_s * k
        first = slope(now, turn_now)
        if rk4:
            second = slope(now + step_s / 2 * first, turn_now + rate * step_s / 2)
            third = slope(now + step_s / 2 * second, turn_now + rate * step_s / 2)
            fourth = slope(now + step_s * third, turn_now + rate * step_s)
            path.append(now + step_s / 6 * (first + 2 * second + 2 * third + fourth))
        else:
            velocity = now[3:] + step_s * first[3:]
            path.append(np.concatenate([now[:3] + step_s * velocity, velocity]))
    return np.array(path)
