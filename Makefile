# Talus. `make demo` runs the main job, `make test` passes the tests; both install what is missing on Debian.
#   make [MODE=native|debug|asan|tsan] [CC=gcc|clang] [BUILD=build]      everything into $(BUILD)/

MODE  ?= native
CC    := $(if $(filter default,$(origin CC)),gcc,$(CC))
CXX   := $(if $(findstring clang,$(CC)),clang++,g++)
BUILD ?= build
OUT   := $(BUILD)$(if $(filter-out native,$(MODE)),-$(MODE))
VERSION := 0.1.0

PACKAGES := gsl yaml-0.1 hdf5 libxxhash qhull_r
DEBIAN   := gcc g++ make pkg-config libcgal-dev libqhull-dev libgsl-dev libyaml-dev libhdf5-dev libxxhash-dev \
            gnuplot-nox fonts-dejavu-core libcmocka-dev
# CGAL is header-only and optional; qhull is always there.
HAVE_CGAL := $(shell printf '\#include <CGAL/version.h>\n' | $(CXX) -E -x c++ - >/dev/null 2>&1 && echo yes)

# Floating point: the same bits for any number of threads and on any x86-64: no reassociation (-ffast-math never), no
# fused multiply-add. -fno-math-errno and -fno-trapping-math change no result; they let loops vectorise.
FLOAT    := -ffp-contract=off -fno-math-errno -fno-trapping-math
WARN     := -Wall -Wextra -Wshadow -Wvla -Wdouble-promotion
WARN_C   := $(WARN) -Wstrict-prototypes -Wmissing-prototypes
native   := -O3 -march=native -g
debug    := -O0 -g
asan     := -O1 -g -fsanitize=address,undefined -fno-omit-frame-pointer -fno-sanitize-recover=undefined
tsan     := -O1 -g -fsanitize=thread
# gcc's OpenMP runtime is not instrumented: the thread sanitizer runs with clang's (Archer), or on one thread of ours.
OPENMP   := -fopenmp
INCLUDE  := -Igeom -Isrc
DEFINE   := -D_GNU_SOURCE -DTAL_VERSION='"$(VERSION)"' $(if $(HAVE_CGAL),-DTAL_HAVE_CGAL)
CFLAGS   = -std=gnu17 $($(MODE)) $(FLOAT) $(WARN_C) $(OPENMP) $(INCLUDE) $(DEFINE) -fPIC $(shell pkg-config --cflags $(PACKAGES)) $(EXTRA)
# CGAL's exact predicates switch the rounding mode; only its own file is compiled so.
CXXFLAGS = -std=c++17 -O2 -g -ffp-contract=off $(if $(findstring clang,$(CC)),,-frounding-math) $(WARN) -Wno-shadow -Wno-double-promotion $(INCLUDE) $(DEFINE) -fPIC $(EXTRA)
LDLIBS   = $(shell pkg-config --libs $(PACKAGES)) $(if $(HAVE_CGAL),-lgmp -lmpfr) -lstdc++ -lm

SOURCES  := $(filter-out src/main.c $(wildcard src/cli*.c),$(wildcard geom/*.c src/*.c)) $(if $(HAVE_CGAL),geom/delaunay_cgal.cpp)
PROGRAM  := src/main.c $(wildcard src/cli*.c)
TESTS    := $(basename $(notdir $(wildcard tests/*.c)))
BENCHES  := $(basename $(notdir $(wildcard tests/bench/*.c)))
objects   = $(addprefix $(OUT)/,$(addsuffix .o,$(basename $(1))))

.PHONY: all demo test check-deps deps asan tsan bench format format-check install clean pictures
.SECONDARY:
.DELETE_ON_ERROR:

all: $(OUT)/talus $(OUT)/libtalus.so $(OUT)/talus.pc

$(OUT)/talus: $(call objects,$(PROGRAM)) $(OUT)/libtalus.a
	$(CC) $($(MODE)) $(OPENMP) $(EXTRA) -o $@ $^ $(LDLIBS)
$(OUT)/libtalus.a: $(call objects,$(SOURCES))
	rm -f $@ && ar rcs $@ $^
$(OUT)/libtalus.so: $(call objects,$(SOURCES))
	$(CC) $($(MODE)) -shared $(OPENMP) $(EXTRA) -Wl,-soname,libtalus.so -o $@ $^ $(LDLIBS)
$(OUT)/talus.pc: Makefile
	@mkdir -p $(@D)
	@printf 'prefix=%s\nName: talus\nDescription: 2D micromechanics of granular media\nVersion: %s\nLibs: -L$${prefix}/lib -ltalus\nCflags: -I$${prefix}/include/talus\nRequires: %s\n' '$(or $(PREFIX),/usr/local)' '$(VERSION)' '$(PACKAGES)' > $@
$(OUT)/tests/%: $(OUT)/tests/%.o $(OUT)/libtalus.a
	$(CC) $($(MODE)) $(OPENMP) $(EXTRA) -o $@ $^ -lcmocka $(LDLIBS)
$(OUT)/%.o: %.c | check-deps
	@mkdir -p $(@D)
	$(CC) $(CFLAGS) -MMD -MP -c -o $@ $<
$(OUT)/%.o: %.cpp | check-deps
	@mkdir -p $(@D)
	$(CXX) $(CXXFLAGS) -MMD -MP -c -o $@ $<
-include $(shell find $(OUT) -name '*.d' 2>/dev/null)

# Names what is missing and how to get it.
check-deps:
	@command -v pkg-config >/dev/null && pkg-config --exists $(PACKAGES) || { \
	  echo "talus: missing packages; on Debian or Ubuntu:"; echo "  apt-get install $(DEBIAN)"; \
	  echo "or: make deps"; exit 1; }
	@$(if $(HAVE_CGAL),true,echo "talus: CGAL not found: building with qhull only (libcgal-dev gives the faster backend)")

deps:
	@sh tests/install-deps.sh $(DEBIAN)
demo: deps
	@$(MAKE) --no-print-directory all
	@sh experiments/biaxial/demo.sh $(OUT)/talus
test: deps
	@$(MAKE) --no-print-directory -j2 run-tests
run-tests: all $(addprefix $(OUT)/tests/,$(TESTS))
	@TALUS=$(OUT)/talus sh tests/run.sh $(addprefix $(OUT)/tests/,$(TESTS))
asan tsan:
	@$(MAKE) --no-print-directory MODE=$@ run-tests
bench: $(addprefix $(OUT)/tests/bench/,$(BENCHES))
	@for b in $^; do $$b || exit 1; done

FORMATTED := $(wildcard geom/*.[ch] geom/*.cpp src/*.[ch] tests/*.[ch] tests/bench/*.c)
format:
	clang-format -i $(FORMATTED)
format-check:
	clang-format --dry-run -Werror $(FORMATTED)
install: all
	install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/lib/pkgconfig $(DESTDIR)$(PREFIX)/include/talus
	install $(OUT)/talus $(DESTDIR)$(PREFIX)/bin
	install -m 644 $(OUT)/libtalus.a $(OUT)/libtalus.so $(DESTDIR)$(PREFIX)/lib
	install -m 644 $(OUT)/talus.pc $(DESTDIR)$(PREFIX)/lib/pkgconfig
	install -m 644 src/*.h geom/*.h $(DESTDIR)$(PREFIX)/include/talus
PREFIX ?= /usr/local
clean:
	rm -rf $(BUILD) $(BUILD)-debug $(BUILD)-asan $(BUILD)-tsan
