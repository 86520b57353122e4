# make install PREFIX=/usr/local DESTDIR=     the C library, its header and raykern.pc
# make uninstall                              takes them away again

PREFIX ?= /usr/local
CARGO ?= cargo
STRIP ?= strip
CARGO_TARGET_DIR ?= target
export CARGO_TARGET_DIR

VERSION := 0.1.0
MAJOR := 0
# What the static library asks of the system on Linux (rustc --print native-static-libs), but for libgcc_s, which is shared only.
PRIVATE := -lgcc_eh -lutil -lrt -lpthread -lm -ldl -lc

ROOT := $(DESTDIR)$(PREFIX)
BUILT := $(CARGO_TARGET_DIR)/release
SHARED := libraykern.so.$(VERSION)

.PHONY: all install uninstall
all:
	$(CARGO) build --release -p raykern-c

install: all
	install -d $(ROOT)/include $(ROOT)/lib/pkgconfig
	install -m 644 include/raykern.h $(ROOT)/include/
	install -m 644 $(BUILT)/libraykern.a $(ROOT)/lib/
	install -m 755 $(BUILT)/libraykern.so $(ROOT)/lib/$(SHARED)
	$(STRIP) -g $(ROOT)/lib/libraykern.a $(ROOT)/lib/$(SHARED)
	ln -sf $(SHARED) $(ROOT)/lib/libraykern.so.$(MAJOR)
	ln -sf libraykern.so.$(MAJOR) $(ROOT)/lib/libraykern.so
	sed -e 's|@PREFIX@|$(PREFIX)|; s|@VERSION@|$(VERSION)|; s|@PRIVATE@|$(PRIVATE)|' \
	    raykern.pc.in > $(ROOT)/lib/pkgconfig/raykern.pc

uninstall:
	rm -f $(ROOT)/include/raykern.h $(ROOT)/lib/libraykern.a $(ROOT)/lib/$(SHARED)
	rm -f $(ROOT)/lib/libraykern.so.$(MAJOR) $(ROOT)/lib/libraykern.so
	rm -f $(ROOT)/lib/pkgconfig/raykern.pc
