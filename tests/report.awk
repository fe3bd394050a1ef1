# Reports tests by name after a run of ctest:  awk -f tests/report.awk LastTest.log EXPECTED [SHARD.xml]...
#
# LastTest.log  ctest's log of the run
# EXPECTED      names of tests that must have a result, one a line: those of programs of which a process ended early
# SHARD.xml     what GoogleTest wrote of a process, which is called PROGRAM.N. A process that crashes or is stopped
#               writes none: what it ran is then read from the log.
#
# Prints the output of failed tests, their names, the skipped tests with their reasons, and last the line
# "N passed, N failed, N skipped". The exit status is 1 if a test failed or none ran.

function note(test, state) {
  if (!(test in states)) tests[++test_count] = test
  states[test] = state
}

function program_of(shard) { sub(/\.[0-9]+$/, "", shard); return shard }

# The value of an attribute of an XML element.
function attribute(line, name,    at) {
  at = index(line, " " name "=\"")
  if (!at) return ""
  line = substr(line, at + length(name) + 3)
  line = substr(line, 1, index(line, "\"") - 1)
  gsub(/&#x0[AD];/, "\n", line); gsub(/&lt;/, "<", line); gsub(/&gt;/, ">", line); gsub(/&quot;/, "\"", line)
  gsub(/&apos;/, "'", line); gsub(/&amp;/, "\\&", line)
  return line
}

# A reason without the place in the source, which stands before it.
function reason_of(text) {
  gsub(/[ \n]+/, " ", text)
  sub(/^ ?[^ ]*:[0-9]+:?( Skipped)? /, "", text)
  sub(/ $/, "", text)
  return text
}

# The log. `running` is the test whose output follows; what is outside of tests belongs to the process.
FILENAME ~ /\.log$/ {
  if ($0 ~ /^[0-9]+\/[0-9]+ Testing: /) { shard = $NF; shards[++shard_count] = shard; running = ""; next }
  if (/\[ RUN      \] /) {
    running = program_of(shard) "." $NF
    begun[shard, ++begun_count[shard]] = running
    next
  }
  if (/^<end of output>$/) running = ""
  if (/^Test Passed\.$/) passed_as_process[shard] = 1
  if (running == "") { if (!/^\[/) output[shard] = output[shard] "  " $0 "\n"; next }
  if (/\[(       OK|  FAILED |  SKIPPED) \] /) {
    ended[running] = /\[       OK \]/ ? "passed" : /\[  SKIPPED \]/ ? "skipped" : "failed"
    if (/\[  SKIPPED \]/) reasons[running] = reason_of(output[running])
    running = ""
    next
  }
  output[running] = output[running] "  " $0 "\n"
  next
}

FILENAME !~ /\.xml$/ { expected[++expected_count] = $0; next }

/^<testsuites / { shard = FILENAME; sub(/.*\//, "", shard); sub(/\.xml$/, "", shard) }
/^ *<testcase .* status="run"/ {
  test = program_of(shard) "." attribute($0, "classname") "." attribute($0, "name")
  note(test, attribute($0, "result") == "skipped" ? "skipped" : "passed")
}
/^ *<skipped / { reasons[test] = reason_of(attribute($0, "message")) }
/^ *<failure / { note(test, "failed"); has_failures[shard] = 1 }
/^<\/testsuites>/ { is_complete[shard] = 1 }

# A process that failed outside of its tests.
function note_process(shard, when) {
  note(shard when, "failed")
  output[shard when] = output[shard]
}

# What a process that ended early had begun; the last test ended it.
function note_begun(shard,    i, test) {
  for (i = 1; i <= begun_count[shard]; ++i) {
    test = begun[shard, i]
    if (!(test in ended)) output[test] = output[test] "  its process crashed, or was stopped after its time\n"
    note(test, test in ended ? ended[test] : "failed")
  }
  if (!begun_count[shard]) note_process(shard, " (could not start)")
}

END {
  for (i = 1; i <= shard_count; ++i) {
    shard = shards[i]
    if (!is_complete[shard])
      note_begun(shard)
    else if (!passed_as_process[shard] && !has_failures[shard])
      note_process(shard, " (after its last test)")
  }
  for (i = 1; i <= expected_count; ++i)
    if (!(expected[i] in states)) {
      note(expected[i], "failed")
      output[expected[i]] = "  not run: its process ended in a test before it\n"
    }

  for (i = 1; i <= test_count; ++i) ++counts[states[tests[i]]]
  for (i = 1; i <= test_count; ++i)
    if (states[tests[i]] == "failed") printf "\n== %s\n%s", tests[i], output[tests[i]]
  if (counts["failed"]) print "\n== failed:"
  for (i = 1; i <= test_count; ++i)
    if (states[tests[i]] == "failed") print tests[i]
  if (counts["skipped"]) print "\n== skipped:"
  for (i = 1; i <= test_count; ++i)
    if (states[tests[i]] == "skipped") print tests[i] ": " reasons[tests[i]]
  if (!test_count) print "no test ran"
  printf "\n%d passed, %d failed, %d skipped\n", counts["passed"], counts["failed"], counts["skipped"]
  exit counts["failed"] || !test_count
}
