# Studies of the motion in time: the choice of the scheme, frequencies, the lag behind a moving gripper.


rule schemes:
    output:
        f"{RESULTS}/studies/schemes.nc",
    log:
        f"{LOGS}/schemes.log",
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        **CONFIG["studies"]["schemes"],
    script:
        "../scripts/schemes.py"


rule modes:
    output:
        f"{RESULTS}/studies/modes.nc",
    log:
        f"{LOGS}/modes.log",
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        **CONFIG["studies"]["modes"],
    script:
        "../scripts/modes.py"


rule lag:
    output:
        f"{RESULTS}/studies/lag.nc",
    log:
        f"{LOGS}/lag.log",
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        **CONFIG["studies"]["lag"],
    script:
        "../scripts/lag.py"


rule fall_accuracy:
    output:
        f"{RESULTS}/studies/fall_accuracy.nc",
    log:
        f"{LOGS}/fall_accuracy.log",
    threads: ALONE
    params:
        **CONFIG["studies"]["fall_accuracy"],
    script:
        "../scripts/fall_accuracy.py"
