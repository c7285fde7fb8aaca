# From alpha to the force model, and the model on trial.


rule symmetry:
    # Extend alpha to all intrusion angles by symmetry.
    input:
        PLAN.inputs("symmetry"),
    output:
        update(PLAN.outputs("symmetry")),
    log:
        "results/logs/symmetry.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="symmetry",
        state=PLAN.state("symmetry"),
    shell:
        STAGE


rule maps:
    # Complete alpha in every direction by the shape that known media share.
    input:
        PLAN.inputs("maps"),
    output:
        update(PLAN.outputs("maps")),
    log:
        "results/logs/maps.log",
    # the figures wait for it
    priority: 1
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="maps",
        state=PLAN.state("maps"),
    shell:
        STAGE


rule fourier:
    # Fit the nine Fourier terms.
    input:
        PLAN.inputs("fourier"),
    output:
        update(PLAN.outputs("fourier")),
    log:
        "results/logs/fourier.log",
    # the figures wait for it
    priority: 1
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="fourier",
        state=PLAN.state("fourier"),
    shell:
        STAGE


rule scaling:
    # Scale media onto one another: zeta, chi, generic M0.
    input:
        PLAN.inputs("scaling"),
    output:
        update(PLAN.outputs("scaling")),
    log:
        "results/logs/scaling.log",
    # the figures wait for it
    priority: 1
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="scaling",
        state=PLAN.state("scaling"),
    shell:
        STAGE


rule legs_predicted:
    # Predict forces on legs and compare with the measured ones.
    input:
        PLAN.inputs("legs_predicted"),
    output:
        update(PLAN.outputs("legs_predicted")),
    log:
        "results/logs/legs_predicted.log",
    # the figures wait for it
    priority: 1
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="legs_predicted",
        state=PLAN.state("legs_predicted"),
    shell:
        STAGE


rule natural_sands:
    # Scale natural sands from one penetration test.
    input:
        PLAN.inputs("natural_sands"),
    output:
        update(PLAN.outputs("natural_sands")),
    log:
        "results/logs/natural_sands.log",
    # the figures wait for it
    priority: 1
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="natural_sands",
        state=PLAN.state("natural_sands"),
    shell:
        STAGE


rule validate:
    # Put the paper's numbers beside ours: the reproduction table.
    input:
        PLAN.inputs("validate"),
    output:
        update(PLAN.outputs("validate")),
    log:
        "results/logs/validate.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="validate",
        state=PLAN.state("validate"),
    shell:
        STAGE
