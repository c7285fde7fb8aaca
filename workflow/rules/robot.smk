# The legged robot on the measured and modelled media.


rule robot_measured:
    # Turn marker tracks into mean speeds.
    input:
        PLAN.inputs("robot_measured"),
    output:
        update(PLAN.outputs("robot_measured")),
    log:
        "results/logs/robot_measured.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="robot_measured",
        state=PLAN.state("robot_measured"),
    shell:
        STAGE


rule robot_sweep:
    # Run the robot over curvature and stride frequency, and on draws of alpha.
    input:
        PLAN.inputs("robot_sweep"),
    output:
        update(PLAN.outputs("robot_sweep")),
    log:
        "results/logs/robot_sweep.log",
    # on all cores: first, while all are free
    priority: 2
    conda:
        "../envs/rftfit.yaml"
    threads: workflow.cores
    params:
        stage="robot_sweep",
        state=PLAN.state("robot_sweep"),
    shell:
        STAGE


rule robot_motion:
    # Keep the motion and forces of some runs, for figures and page.
    input:
        PLAN.inputs("robot_motion"),
    output:
        update(PLAN.outputs("robot_motion")),
    log:
        "results/logs/robot_motion.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="robot_motion",
        state=PLAN.state("robot_motion"),
    shell:
        STAGE
