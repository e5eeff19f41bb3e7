# What `make help` shows: the captions behind `##` in the Makefile, in groups; without `all`, the first group with its
# captions and the others by their names.
function flush_names() {
    if (names != "") printf "%s\n", names
    names = ""
}
BEGIN { FS = " *## "; print "Usage: make TARGET" }
/^##@ / {
    flush_names()
    printf "\n%s\n", substr($0, 5)
    groups++
}
/^[a-zA-Z0-9_.-]+(:| :=).* ## / {
    split($1, words, /\.(paper|cost|makes|publishes) :=|:/)
    if (all || groups == 1) { printf "  %-26s %s\n", words[1], $2; next }
    if (length(names) + length(words[1]) > 112) flush_names()
    names = names (names == "" ? "  " : " ") words[1]
}
END { flush_names(); if (!all) print "\n`make help-all` says what each of them does." }
