# The C library, for those who come from C: make install PREFIX=/usr/local [DESTDIR=...] [ARGUMENTS="--features embree"].
# All else is cargo's.

PREFIX ?= /usr/local
ARGUMENTS ?=

.PHONY: install
install:
	DESTDIR="$(DESTDIR)" scripts/install.sh "$(PREFIX)" $(ARGUMENTS)
