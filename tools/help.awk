# What `make help` shows: the captions behind `##` in the Makefile, in groups, and the titles of figures and tables in
# captions.toml; without `all`, the first group with its captions and the others by their names.
function show(name, caption) {
    if (all || groups == 1) { printf "  %-26s %s\n", name, caption; return }
    if (length(names) + length(name) > 112) flush_names()
    names = names (names == "" ? "  " : " ") name
}
function flush_names() {
    if (names != "") printf "%s\n", names
    names = ""
}
BEGIN { print "Usage: make TARGET" }
/^\[/ && FILENAME ~ /toml$/ { figure = substr($0, 2, length($0) - 2) }
/^title = / && FILENAME ~ /toml$/ { title[++figures] = figure "\t" substr($0, 10, length($0) - 10) }
FILENAME ~ /toml$/ { next }
/^##@ / {
    flush_names()
    if (all || groups++ < 2) print ""
    print substr($0, 5)
    if (/Figures, tables/) for (i = 1; i <= figures; i++) { split(title[i], words, "\t"); show(words[1], words[2]) }
}
/^[a-zA-Z0-9_%-]+:.*  ## / { show(substr($0, 1, index($0, ":") - 1), substr($0, index($0, "  ## ") + 5)) }
END { flush_names(); if (!all) print "\n`make help-all` says what each of them does." }
