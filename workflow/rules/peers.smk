# Other programs on the same strip. They have an environment of their own, which only `make peers` makes: without it
# nothing here runs, and the result that the repository keeps is taken (`of_peers`).


rule peers:
    output:
        f"{RESULTS}/studies/peers.nc",
    log:
        f"{LOGS}/peers.log",
    threads: ALONE
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        **CONFIG["studies"].get("peers", {}),
        folder=PEERS,
    script:
        "../scripts/peers.py"
