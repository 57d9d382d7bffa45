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
#include <cstring>

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
}

void read_all(const Table& t) {
    for (const String& name : t.tableDesc().columnNames().tovector()) {
        const ColumnDesc& desc = t.tableDesc().columnDesc(name);
        // Errors are for the parent to meet and to word: only what ends the process matters here.
        guard([&] {
            switch (desc.dataType()) {
                case TpBool: return read_all<Bool>(t, name, desc.isScalar());
                case TpInt: return read_all<Int>(t, name, desc.isScalar());
                case TpFloat: return read_all<Float>(t, name, desc.isScalar());
                case TpDouble: return read_all<Double>(t, name, desc.isScalar());
                case TpComplex: return read_all<Complex>(t, name, desc.isScalar());
                case TpString: return read_all<String>(t, name, desc.isScalar());
                default: return;
            }
        });
    }
}

}  // namespace

extern "C" int ct_probe(const char* path) {
    return guard([&] {
        const pid_t child = fork();
        if (child < 0) throw AipsError(String("cannot start a process to look at it: ") + std::strerror(errno));
        if (child == 0) {
            const rlimit no_core{0, 0};
            setrlimit(RLIMIT_CORE, &no_core);
            const int null = open("/dev/null", O_WRONLY);
            if (null >= 0) {
                dup2(null, STDOUT_FILENO);
                dup2(null, STDERR_FILENO);
            }
            guard([&] { read_all(Table(path, TableLock(TableLock::NoLocking), Table::Old)); });
            // Neither destructors of the parent's objects nor its buffers are the child's business.
            _exit(0);
        }
        int status = 0;
        while (waitpid(child, &status, 0) < 0 && errno == EINTR) {}
        if (WIFSIGNALED(status)) {
            throw AipsError(String("a table so broken that casacore crashes on it (") + strsignal(WTERMSIG(status)) + ")");
        }
    });
}
