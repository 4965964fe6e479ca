"""A witness that answers as planar.py does, and then does what its argument says."""
import json
import os
import runpy
import sys
import time

how, planar = sys.argv[1], sys.argv[2]
if how == "dies":
    print("no licence")
    sys.exit(3)
if how == "crashes":
    os.abort()
if how == "hangs":
    time.sleep(60)
if how == "forks":
    if os.fork() == 0:
        time.sleep(60)
    time.sleep(60)
if how == "prints":
    while True:
        print("x" * 1000)
if how == "eats":
    memory = bytearray(1 << 32)
if how == "writes":
    with open("traces.csv", "w") as file:
        while True:
            file.write("1,2,3\n" * 1000)
if how == "nothing":
    sys.exit(0)

runpy.run_path(planar, run_name="__main__")
with open("traces.csv") as file:
    head, *rows = file.read().splitlines()
rows = [row.split(",") for row in rows]
names = head.split(",")
force = names.index("motor.force")
with open("witness.json") as file:
    answer = json.load(file)

if how == "few":
    rows = rows[:-3]
elif how == "nan":
    rows[4][force] = "nan"
elif how == "late":
    rows[4][0] = "0.0401"
elif how == "short":
    rows[4] = rows[4][:-1]
elif how == "unknown":
    names[force] = "motr.force"
elif how == "twice":
    names[force] = "motor.velocity"
elif how == "foot":
    answer["units"] = "foot, pound"
elif how == "kilo":
    for row in rows:
        row[force] = repr(float(row[force]) / 1000)
elif how == "perturbed":
    for row in rows:
        row[force] = repr(float(row[force]) * (1 + 1e-8))
elif how == "refuses":
    answer["refused"] = "it has a loop"
elif how == "schema":
    answer["schema"] = "mbverify/witness/0"
elif how == "inf":
    rows[4][force] = "inf"
elif how == "moves":  # without forces
    rows = [row[:force] + row[force + 1:] for row in rows]
    del names[force]
elif how == "untimed":
    names[0] = "seconds"
elif how == "listed":
    answer = [answer]
elif how == "nameless":
    del answer["program"]
elif how == "loud":
    answer["program"] = "planar \x1b[2J\x1b]0;title\x07"
elif how == "reports":
    with open(sys.argv[3], "w") as file:
        file.write("\n".join(sorted(os.environ)))
elif how == "link":
    os.remove("traces.csv")
    os.symlink("/dev/zero", "traces.csv")

if how != "link":
    with open("traces.csv", "w") as file:
        file.write("\n".join([",".join(names)] + [",".join(row) for row in rows]) + "\n")
with open("witness.json", "w") as file:
    file.write("{" if how == "garbage" else json.dumps(answer))
