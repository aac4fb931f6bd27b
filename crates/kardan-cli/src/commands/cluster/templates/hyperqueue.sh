#!/bin/sh
#HQ --name={{name}}
#HQ --array={{array}}
#HQ --cpus={{threads}}
#HQ --stdout=none
#HQ --stderr={{logs}}/%{TASK_ID}.hq:rm-if-finished
exec {{shard}} "$HQ_TASK_ID"
