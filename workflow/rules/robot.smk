# Rules of the legged robot (src/rftfit/workflow/robot.py); robot_full: the paper's whole sweep, `rftfit sweep`.


use rule stage as robot_measured with:
    # Turn marker tracks into mean speeds.
    input:
        state=state_of("robot_measured"),
    output:
        tracks="results/robot/tracks.csv",
        measured="results/robot/measured.csv",
        strides="results/robot/strides.csv",
        ledger="results/ledger/robot.csv",
        flags="results/robot/flags.csv",
    log:
        "results/logs/robot_measured.log",


use rule stage as robot_runs with:
    # Run the robot over curvature and stride frequency, on one profile of its medium.
    input:
        checks=CHECKS,
        alpha=ALPHA,
        measured="results/robot/measured.csv",
        teachers=TEACHERS,
        state=state_of("robot_runs"),
    output:
        "results/robot/{runs}.csv",
    log:
        "results/logs/robot_runs/{runs}.log",
    priority: 3


use rule stage as robot_intervals with:
    # Run the robot on draws of alpha: half widths of speeds and best curvature.
    input:
        checks=CHECKS,
        alpha=ALPHA,
        errors="results/leg_errors.csv",
        measured="results/robot/measured.csv",
        teachers=TEACHERS,
        state=state_of("robot_intervals"),
    output:
        "results/robot/intervals.csv",
    log:
        "results/logs/robot_intervals.log",
    priority: 4


use rule stage as robot_speeds with:
    # Join the runs of all profiles, find the best curvature, compare with what was measured.
    input:
        checks=CHECKS,
        runs=expand("results/robot/runs_{profile}.csv", profile=PROFILES),
        measured="results/robot/measured.csv",
        intervals="results/robot/intervals.csv",
        state=state_of("robot_speeds"),
    output:
        speed="results/robot/speed.csv",
        optimum="results/robot/optimum.csv",
        errors="results/robot/errors.csv",
    log:
        "results/logs/robot_speeds.log",


use rule stage as robot_motion with:
    # Keep the motion and forces of some runs, for figures and page.
    input:
        alpha=ALPHA,
        teachers=TEACHERS,
        state=state_of("robot_motion"),
    output:
        motion="results/robot/motion.csv",
        stances="results/robot/stances.csv",
        frames="results/robot/frames.json",
    log:
        "results/logs/robot_motion.log",


use rule stage as robot_full_runs with:
    # The same over all curvatures, frequencies and starting phases of the paper.
    input:
        checks=CHECKS,
        alpha=ALPHA,
        measured="results/robot/measured.csv",
        teachers=TEACHERS,
        state=state_of("robot_full_runs"),
    output:
        "results/robot_full/{runs}.csv",
    log:
        "results/logs/robot_full_runs/{runs}.log",


use rule stage as robot_full_speeds with:
    # Join the runs of the whole sweep.
    input:
        checks=CHECKS,
        runs=expand("results/robot_full/runs_{profile}.csv", profile=PROFILES),
        measured="results/robot/measured.csv",
        intervals="results/robot/intervals.csv",
        state=state_of("robot_full_speeds"),
    output:
        speed="results/robot_full/speed.csv",
        optimum="results/robot_full/optimum.csv",
        errors="results/robot_full/errors.csv",
    log:
        "results/logs/robot_full_speeds.log",
