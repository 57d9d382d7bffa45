// Look at a table in a child process first. casacore ends the process on some broken files (it rethrows outside of any handler when
// a column's class is unknown, and follows the indices of its buckets unchecked): no handler can catch that, a parent can.
#include "handle.h"

#include <casacore/tables/Tables/ArrayColumn.h>
#include <casacore/tables/Tables/ScalarColumn.h>
#include <casacore/tables/Tables/TableRecord.h>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>

using namespace casacore;

namespace {

// Arrays are read cell by cell in tables up to so many rows; of longer tables the first and the last cell stand for all.
const rownr_t FEW = 65536;

template <typename T>
void read_all(const Table& t, const String& name, bool scalar) {
    const rownr_t n = t.nrow();
    if (scalar) {
        ScalarColumn<T> c(t, name);
        for (rownr_t r = 0; r < n; r += FEW) {
            c.getColumnRange(Slicer(IPosition(1, r), IPosition(1, std::min(FEW, n - r))));
        }
        return;
    }
    ArrayColumn<T> c(t, name);
    for (rownr_t r = 0; r < n; r += n <= FEW ? 1 : n - 1) {
        if (c.isDefined(r)) c(r);
    }
    // Runs of rows go through other code of the storage managers than single cells. casacore takes the shape of the first cell for all,
    // so that a run ends where the shape changes (another spectral window).
    rownr_t run = 0;
    while (run < std::min(rownr_t(1024), n) && c.isDefined(run) && c.shape(run).isEqual(c.shape(0))) ++run;
    if (run > 0) c.getColumnRange(Slicer(IPosition(1, 0), IPosition(1, run)));
}

void read_column(const Table& t, const String& name, const ColumnDesc& desc) {
    switch (desc.dataType()) {
        case TpBool: return read_all<Bool>(t, name, desc.isScalar());
        case TpInt: return read_all<Int>(t, name, desc.isScalar());
        case TpFloat: return read_all<Float>(t, name, desc.isScalar());
        case TpDouble: return read_all<Double>(t, name, desc.isScalar());
        case TpComplex: return read_all<Complex>(t, name, desc.isScalar());
        case TpString: return read_all<String>(t, name, desc.isScalar());
        default: return;
    }
}

void read_all(const Table& t) {
    for (const String& name : t.tableDesc().columnNames().tovector()) {
        const ColumnDesc& desc = t.tableDesc().columnDesc(name);
        // Errors are for the parent to meet and to word, but for memory without measure and for what ends the process.
        try {
            read_column(t, name, desc);
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const std::exception&) {
        }
    }
}

// Lengths in broken files claim memory without measure: give the process a little more than it has.
void limit_memory() {
    const rlim_t MORE = rlim_t(1) << 30;
    long pages = 0;
    if (FILE* f = std::fopen("/proc/self/statm", "r")) {
        if (std::fscanf(f, "%ld", &pages) != 1) pages = 0;
        std::fclose(f);
    }
    if (pages > 0) {
        const rlim_t limit = rlim_t(pages) * sysconf(_SC_PAGESIZE) + MORE;
        const rlimit memory{limit, limit};
        setrlimit(RLIMIT_AS, &memory);
    }
}

}  // namespace

extern "C" int ct_probe(const char* path) {
    return guard([&] {
        int ends[2];
        if (pipe(ends) != 0) throw AipsError(String("cannot make a pipe: ") + std::strerror(errno));
        const pid_t child = fork();
        if (child < 0) {
            close(ends[0]);
            close(ends[1]);
            throw AipsError(String("cannot start a process to look at it: ") + std::strerror(errno));
        }
        if (child == 0) {
            const rlimit no_core{0, 0};
            setrlimit(RLIMIT_CORE, &no_core);
            limit_memory();
            const int null = open("/dev/null", O_WRONLY);
            if (null >= 0) {
                dup2(null, STDOUT_FILENO);
                dup2(null, STDERR_FILENO);
            }
            const int failed = guard([&] { read_all(Table(path, TableLock(TableLock::NoLocking), Table::Old)); });
            if (failed) {
                const std::string& error = ct::last_error();
                // A message that does not fit the pipe or finds no reader is not worth more trouble.
                if (write(ends[1], error.data(), std::min<size_t>(error.size(), 1000)) < 0) _exit(2);
            }
            // Neither destructors of the parent's objects nor its buffers are the child's business.
            _exit(failed);
        }
        close(ends[1]);
        char text[1001] = {};
        ssize_t got = 0;
        while ((got = read(ends[0], text, 1000)) < 0 && errno == EINTR) {}
        close(ends[0]);
        int status = 0;
        while (waitpid(child, &status, 0) < 0 && errno == EINTR) {}
        if (WIFSIGNALED(status)) {
            throw AipsError(String("a table so broken that casacore crashes on it (") + strsignal(WTERMSIG(status)) + ")");
        }
        if (WIFEXITED(status) && WEXITSTATUS(status) != 0) {
            const bool memory = std::strstr(text, "bad_alloc") != nullptr;
            throw AipsError(memory || got <= 0 ? String("lengths in it that no memory holds") : String(text));
        }
    });
}
