# Talus. `make demo` runs the main job, `make test` passes the tests; both install what is missing on Debian.
#   make [MODE=native|costs|debug|asan|tsan] [CC=gcc|clang] [BUILD=build] [PREFIX=/usr/local] [EXTRA=FLAGS] [HAVE_CGAL=]

VERSION := 0.1.0
MODE    ?= native
BUILD   ?= build
PREFIX  ?= /usr/local
CC      := $(if $(filter default,$(origin CC)),gcc,$(CC))
CLANG   := $(findstring clang,$(CC))
CXX     := $(if $(filter default,$(origin CXX)),$(if $(CLANG),clang++,g++),$(CXX))
OUT     := $(BUILD)$(if $(filter-out native,$(MODE)),-$(MODE))

PACKAGES := gsl yaml-0.1 hdf5 libxxhash qhull_r
NEEDED   := $(if $(CLANG),clang libomp-dev,gcc) g++ pkg-config libgsl-dev libyaml-dev libhdf5-dev libxxhash-dev libqhull-dev
DEBIAN   := $(NEEDED) libcgal-dev gnuplot-nox fonts-dejavu-core libcmocka-dev
# What the experiments' analysis draws with; nothing else needs it.
ANALYSIS := python3-numpy python3-h5py python3-matplotlib
export PYTHON ?= /usr/bin/python3
# CGAL is header-only and optional, and the faster of the two triangulation backends; qhull is always there.
HAVE_CGAL := $(shell $(CXX) -E -x c++ -include CGAL/version.h /dev/null >/dev/null 2>&1 && echo yes)

# Floating point: the same bits for any number of threads and on any x86-64: no reassociation (-ffast-math never), no
# multiply-add that the source does not fuse itself. -fno-math-errno and -fno-trapping-math change no result; they let
# loops vectorise.
FLOAT    := -ffp-contract=off -fno-math-errno -fno-trapping-math
native   := -O3 -march=native -g
# What valgrind knows.
costs    := -O3 -march=x86-64-v3 -g
debug    := -O0 -g
asan     := -O1 -g -fsanitize=address,undefined -fno-omit-frame-pointer -fno-sanitize-recover=undefined
tsan     := -O1 -g -fsanitize=thread
# The hot loops, compiled once more for each width of vectors; a run takes the widest that its processor has (src/hot.h).
HOT      := $(addprefix src/,contact_block kick forces_range drift implicit_block)
WIDTHS   := $(if $(findstring x86_64,$(shell $(CC) -dumpmachine)),v3 v4)
width_v3 := -march=x86-64-v3
width_v4 := -march=x86-64-v4 -mprefer-vector-width=512
# -Wno-pass-failed: that clang leaves a loop marked simd scalar is a matter of speed alone.
WARN     := -Wall -Wextra -Wvla $(if $(CLANG),-Wno-pass-failed)
WARN_C   := $(WARN) -Wshadow -Wdouble-promotion -Wstrict-prototypes -Wmissing-prototypes
DEFINE   := -D_GNU_SOURCE -DTAL_VERSION=\"$(VERSION)\" $(if $(HAVE_CGAL),-DTAL_HAVE_CGAL) \
  $(if $(WIDTHS),-DTAL_HAVE_WIDTHS)
SYSTEM   := $(shell pkg-config --cflags $(PACKAGES) 2>/dev/null)
COMMON   := -fopenmp -fPIC -Igeom -Isrc $(DEFINE)
CFLAGS   := -std=gnu17 $($(MODE)) $(FLOAT) $(WARN_C) $(COMMON) $(SYSTEM) $(EXTRA)
# CGAL's exact predicates switch the rounding mode; only its own file is compiled so.
CXXFLAGS := -std=c++17 -O2 -g -ffp-contract=off -frounding-math $(WARN) $(COMMON) $(EXTRA)
LDFLAGS  := $($(MODE)) -fopenmp $(EXTRA)
PRIVATE  := $(if $(HAVE_CGAL),-lmpfr -lgmp) -lstdc++ -lm
LDLIBS   := $(shell pkg-config --libs $(PACKAGES) 2>/dev/null) $(PRIVATE)

PROGRAM  := src/main.c $(wildcard src/cli*.c)
SOURCES  := $(filter-out $(PROGRAM),$(wildcard geom/*.c src/*.c)) $(if $(HAVE_CGAL),geom/delaunay_cgal.cpp)
HEADERS  := $(wildcard geom/*.h src/*.h)
objects   = $(addprefix $(OUT)/,$(addsuffix .o,$(basename $(1))))
library  := $(call objects,$(SOURCES)) $(foreach w,$(WIDTHS),$(HOT:%=$(OUT)/%.$(w).o))
TESTS    := $(patsubst %.c,$(OUT)/%,$(wildcard tests/*.c))
BENCHES  := $(patsubst %.c,$(OUT)/%,$(wildcard tests/bench/*.c))
JOBS      = $(if $(findstring jobserver,$(MAKEFLAGS)),,-j$(shell nproc))

.PHONY: all demo test build-tests run-tests hard run-hard faults short asan tsan bench bench-peers costs format \
  format-check install clean deps deps-program check-deps
.SECONDARY:
.DELETE_ON_ERROR:

all: $(OUT)/talus $(OUT)/libtalus.so

$(OUT)/talus: $(call objects,$(PROGRAM)) $(OUT)/libtalus.a
	$(CC) $(LDFLAGS) -o $@ $^ $(LDLIBS)
$(OUT)/libtalus.a: $(library)
	rm -f $@ && ar rcs $@ $^
$(OUT)/libtalus.so: $(library)
	$(CC) $(LDFLAGS) -shared -Wl,-soname,$(@F) -o $@ $^ $(LDLIBS)
$(OUT)/tests/%: $(OUT)/tests/%.o $(OUT)/libtalus.a
	$(CC) $(LDFLAGS) -o $@ $^ -lcmocka $(LDLIBS)
# The program with its calls for files and memory failing on demand (tests/faults/inject.c).
FAULTY   := open close read write fsync rename link unlink mkdir ftruncate flock fstat opendir fopen \
  malloc calloc realloc aligned_alloc open_memstream
$(OUT)/tests/faults/talus: $(OUT)/tests/faults/inject.o $(call objects,$(PROGRAM)) $(OUT)/libtalus.a
	$(CC) $(LDFLAGS) $(FAULTY:%=-Wl,--wrap=%) -o $@ $^ $(LDLIBS)
$(OUT)/%.o: %.c $(OUT)/flags
	@mkdir -p $(@D)
	$(CC) $(CFLAGS) -MMD -MP -c -o $@ $<
define WIDTH_RULE
$(OUT)/%.$(1).o: %.c $(OUT)/flags
	@mkdir -p $$(@D)
	$(CC) $(CFLAGS) $(width_$(1)) -DTAL_WIDTH=$(1) -include src/width.h -MMD -MP -c -o $$@ $$<
endef
$(foreach w,$(WIDTHS),$(eval $(call WIDTH_RULE,$(w))))
$(OUT)/%.o: %.cpp $(OUT)/flags
	@mkdir -p $(@D)
	$(CXX) $(CXXFLAGS) -MMD -MP -c -o $@ $<
-include $(wildcard $(OUT)/geom/*.d $(OUT)/src/*.d $(OUT)/tests/*.d $(OUT)/tests/*/*.d)

# Rewritten, and so everything rebuilt, only when the compiler or a flag changes.
$(OUT)/flags: check-deps
	@mkdir -p $(@D)
	@echo '$(CC) $(CFLAGS); $(CXX) $(CXXFLAGS); $(LDLIBS)' | cmp -s - $@ || \
	  echo '$(CC) $(CFLAGS); $(CXX) $(CXXFLAGS); $(LDLIBS)' > $@
check-deps:
	@sh tests/install-deps.sh --check $(NEEDED)
	@$(if $(HAVE_CGAL),true,echo "talus: CGAL not found: building with qhull only (libcgal-dev gives the faster backend)")
deps-program:
	@sh tests/install-deps.sh $(DEBIAN)
deps:
	@sh tests/install-deps.sh $(DEBIAN) $(ANALYSIS)

demo: deps-program
	@$(MAKE) --no-print-directory $(JOBS) all
	@sh experiments/biaxial/demo.sh $(OUT)/talus
test: deps-program
	@$(MAKE) --no-print-directory $(JOBS) run-tests
build-tests: $(OUT)/talus $(OUT)/tests/faults/talus $(TESTS) $(BENCHES)
run-tests: $(OUT)/talus $(OUT)/tests/faults/talus $(TESTS)
	@TALUS=$(OUT)/talus sh tests/run.sh $(TESTS)
# The hard cases: a table of what holds how far, and what happens beyond. LONG=1 adds hours.
HARD := $(patsubst %.c,$(OUT)/%,$(wildcard tests/hard_*.c))
hard: deps-program
	@$(MAKE) --no-print-directory $(JOBS) run-hard
run-hard: $(OUT)/talus $(HARD)
	@HARD=$(if $(LONG),long,plain) TALUS=$(OUT)/talus sh tests/hard.sh $(HARD)
asan:
	@$(MAKE) --no-print-directory $(JOBS) MODE=asan run-tests
# gcc's OpenMP runtime is not instrumented; clang's says through Archer what it orders, so a report is a race of ours.
tsan: export TSAN_OPTIONS := ignore_noninstrumented_modules=1 $(TSAN_OPTIONS)
tsan:
	@$(MAKE) --no-print-directory $(JOBS) MODE=tsan CC=clang run-tests
# Kills, full disks, failing calls, damaged checkpoints, signals in their long form (docs/faults.md): minutes, a table.
FAULTS   := $(filter $(OUT)/tests/faults_%,$(TESTS))
faults: $(OUT)/talus $(OUT)/tests/faults/talus $(FAULTS)
	@TALUS=$(OUT)/talus sh tests/faults.sh $(FAULTS)
# Every experiment in a form of seconds: that its scenes, commands and pictures work.
short: all
	@for t in experiments/test_*.py experiments/*/test_*.py; do TALUS=$(abspath $(OUT)/talus) $(PYTHON) $$t || exit 1; done
	@for e in experiments/*/run.sh; do echo "$$e --short"; \
	  TALUS=$(abspath $(OUT)/talus) OUT=$(abspath $(OUT)/short) sh $$e --short || exit 1; done
bench: $(BENCHES) $(OUT)/talus
	@sh tests/bench/machine.sh
	@for b in $(BENCHES); do $$b || exit 1; done
	@sh tests/bench/estimate.sh $(OUT)/talus
# The same assembly in LAMMPS, where it is installed (package lammps).
bench-peers: $(OUT)/tests/bench/bench_step
	@sh tests/bench/peers.sh $<

# Instructions per grain and step, effect by effect, against those on record.
costs:
	@sh tests/install-deps.sh valgrind
	@$(MAKE) --no-print-directory $(JOBS) MODE=costs $(BUILD)-costs/tests/costs/costs
	@sh tests/costs/run.sh $(BUILD)-costs/tests/costs/costs

FORMATTED := $(HEADERS) $(wildcard geom/*.c geom/*.cpp src/*.c tests/*.[ch] tests/bench/*.[ch] tests/costs/*.c tests/faults/*.c)
format:
	clang-format -i $(FORMATTED)
format-check:
	@clang-format --dry-run -Werror $(FORMATTED)

define PC
prefix=$(PREFIX)
libdir=$${prefix}/lib
includedir=$${prefix}/include

Name: talus
Description: Two-dimensional micromechanics of granular media
Version: $(VERSION)
Requires.private: $(PACKAGES)
Libs: -L$${libdir} -ltalus
Libs.private: -fopenmp $(PRIVATE)
Cflags: -I$${includedir}/talus
endef
install: export PC := $(PC)
install: to := $(DESTDIR)$(PREFIX)
install: all
	install -d $(to)/bin $(to)/lib/pkgconfig $(to)/include/talus
	install $(OUT)/talus $(to)/bin
	install -m 644 $(OUT)/libtalus.a $(OUT)/libtalus.so $(to)/lib
	install -m 644 $(HEADERS) $(to)/include/talus
	@echo "$$PC" > $(to)/lib/pkgconfig/talus.pc
	@[ -n "$(DESTDIR)" ] || ldconfig 2>/dev/null || true
clean:
	rm -rf $(BUILD) $(BUILD)-debug $(BUILD)-asan $(BUILD)-tsan $(BUILD)-costs
