#!/bin/bash
# The job for Kubernetes against the published schemas of several versions, strictly: names that the API does not have are refused.
# pip install kubernetes-validate (it ships the JSON schemas of the API), into any environment; PYTHON names another python3.
PYTHON=${PYTHON:-python3}
"$PYTHON" -c 'import kubernetes_validate' 2>/dev/null || { echo "kubernetes-validate is missing: pip install kubernetes-validate" >&2; exit 2; }
SAMPLES=640
. "$(dirname "$0")/common.sh"
sweep --on kubernetes --shards 10 --out swept --dry-run >job.yaml || fail "no job"
"$PYTHON" - job.yaml <<'CHECK' || fail "the job is not one"
import copy, sys
import kubernetes_validate as kv, yaml

job = yaml.safe_load(open(sys.argv[1]))
versions = ["1.29", "1.31", "1.33", "1.35", "1.37"]
for version in versions:
    kv.validate(job, version, strict=True)
# The check sees what is wrong: a name that there is not, a number that is none, a key that is missing.
def broken(change):
    other = copy.deepcopy(job)
    change(other["spec"])
    try:
        kv.validate(other, versions[-1], strict=True)
    except kv.ValidationError:
        return True
    return False
assert broken(lambda spec: spec.update(backoffLimitForIndex=2))
assert broken(lambda spec: spec.update(completions="ten"))
assert broken(lambda spec: spec.pop("template"))
assert job["spec"]["completionMode"] == "Indexed" and job["spec"]["completions"] == 10
print("ok: job.yaml is a batch/v1 Job of Kubernetes", ", ".join(versions))
CHECK
# Its pods, run here by a shell: every index is a shard.
for index in $(seq 0 9); do
  "$PYTHON" - job.yaml <<'POD' >pod.sh
import sys, yaml
print(yaml.safe_load(open(sys.argv[1]))["spec"]["template"]["spec"]["containers"][0]["args"][0])
POD
  KARDAN=$KARDAN JOB_COMPLETION_INDEX=$index sh pod.sh || fail "index $index"
done
"$KARDAN" sweep merge m.toml swept/parts/* --out swept >/dev/null 2>&1
same swept
echo "$((passed + 1)) passed, 0 failed"
