"""Readings of one push at constant speed, and what sand and a loose cable do to them."""

import numpy as np

RATE_HZ, SPEED_CM_PER_S, N_PER_CM, NOISE_N = 50.0, 0.5, 20.0, 0.02


def push(random, seconds=14.0):
    """Time, height (cm) and force (N) of a push at constant speed after a second of rest in air."""
    time = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    height = 1.0 - SPEED_CM_PER_S * np.clip(time - 1.0, 0, None)
    force = N_PER_CM * np.clip(-height, 0, None)
    return time, height, force + NOISE_N * random.normal(size=time.size)


def stick_slip(random, time):
    """Force that rises by springs of some stiffness and slips by a part of itself, at a few to 30 Hz."""
    rate_hz = random.uniform(2, 30)
    phase = (time * rate_hz + random.random()) % 1
    return random.uniform(0.02, 0.3) * (phase - 0.5)


def irregular_slip(random, time):
    """Force that rises and slips by a part of itself between a third and all, after times that differ."""
    step_s, slips_per_s = time[1] - time[0], random.uniform(2, 15)
    growth_per_s = random.uniform(0.02, 0.3) * slips_per_s
    level, parts, next_slip_s = 0.0, [], random.exponential(1 / slips_per_s)
    for now_s in step_s * np.arange(1, time.size + 1):
        level += growth_per_s * step_s
        if now_s > next_slip_s:
            level *= 1 - random.uniform(1 / 3, 1.0)
            next_slip_s = now_s + random.gamma(2, 0.5 / slips_per_s)
        parts.append(level)
    return np.array(parts) - np.mean(parts)


def slip_among_stones(random, time):
    """Force that slips while stones are pushed aside."""
    return stick_slip(random, time) + stones(random, time)


def crust(random, time):
    """Force that falls by half within one reading, and rises again."""
    breaks = random.uniform(4, 10)
    return np.where(time < breaks, 0.5 * np.exp(-((time - breaks) ** 2)), 0.0)


def stones(random, time):
    """Some stones that are pushed aside, each over 0.06 to 0.3 s."""
    bumps = np.zeros(time.size)
    for middle in random.uniform(3, time[-1], 6):
        bumps += random.uniform(0.05, 0.4) * np.exp(
            -(((time - middle) / random.uniform(0.06, 0.3)) ** 2)
        )
    return bumps
