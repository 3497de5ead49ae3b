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


rule peers_page:
    input:
        rules.peers.output[0],
    log:
        f"{LOGS}/peers_page.log",
    script:
        "../scripts/peers_page.py"
