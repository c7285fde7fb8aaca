# What people look at, and the record of what it was made from.


rule figures:
    # Draw the figures of measurement, model, legs and sands.
    input:
        PLAN.inputs("figures"),
    output:
        update(PLAN.outputs("figures")),
    log:
        "results/logs/figures.log",
    conda:
        "../envs/rftfit.yaml"
    threads: workflow.cores
    params:
        stage="figures",
        state=PLAN.state("figures"),
    shell:
        STAGE


rule quality:
    # Draw the quality sheets: every plate run of a medium.
    input:
        PLAN.inputs("quality"),
    output:
        update(PLAN.outputs("quality")),
    log:
        "results/logs/quality.log",
    conda:
        "../envs/rftfit.yaml"
    threads: workflow.cores
    params:
        stage="quality",
        state=PLAN.state("quality"),
    shell:
        STAGE


rule robot_figures:
    # Draw the figures of the robot.
    input:
        PLAN.inputs("robot_figures"),
    output:
        update(PLAN.outputs("robot_figures")),
    log:
        "results/logs/robot_figures.log",
    conda:
        "../envs/rftfit.yaml"
    threads: workflow.cores
    params:
        stage="robot_figures",
        state=PLAN.state("robot_figures"),
    shell:
        STAGE


rule workbooks:
    # Write the workbooks in the layouts of Tables S5 and S2.
    input:
        PLAN.inputs("workbooks"),
    output:
        update(PLAN.outputs("workbooks")),
    log:
        "results/logs/workbooks.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="workbooks",
        state=PLAN.state("workbooks"),
    shell:
        STAGE


rule page:
    # Write the report page.
    input:
        PLAN.inputs("page"),
    output:
        update(PLAN.outputs("page")),
    log:
        "results/logs/page.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="page",
        state=PLAN.state("page"),
    shell:
        STAGE


rule provenance:
    # Record what every result was made from.
    input:
        PLAN.inputs("provenance"),
    output:
        update(PLAN.outputs("provenance")),
    log:
        "results/logs/provenance.log",
    conda:
        "../envs/rftfit.yaml"
    params:
        stage="provenance",
        state=PLAN.state("provenance"),
    shell:
        STAGE
