// Tables, columns and cells.
#include "handle.h"

#include <casacore/tables/DataMan/IncrementalStMan.h>
#include <casacore/tables/DataMan/StandardStMan.h>
#include <casacore/tables/DataMan/TiledColumnStMan.h>
#include <casacore/tables/DataMan/TiledShapeStMan.h>
#include <casacore/tables/Tables/ArrColDesc.h>
#include <casacore/tables/Tables/ArrayColumn.h>
#include <casacore/tables/Tables/ScaColDesc.h>
#include <casacore/tables/Tables/ScalarColumn.h>
#include <casacore/tables/Tables/SetupNewTab.h>
#include <casacore/tables/Tables/TableInfo.h>

#include <cstdlib>
#include <exception>
#include <filesystem>
#include <memory>

using namespace casacore;

std::string& ct::last_text() {
    static std::string text;
    return text;
}

std::string& ct::last_error() {
    static std::string text;
    return text;
}

namespace {

// Only this process knows the directory that is being written, and nobody should wait for what is being read. The lock is made at the first use:
// casacore reads its settings then, and throws where HOME is not set. Before main nobody could catch that, and every command would abort.
const TableLock& no_lock() {
    static const TableLock lock(TableLock::NoLocking);
    return lock;
}

IPosition position(const int64_t* values, size_t n) {
    IPosition p(n);
    for (size_t i = 0; i < n; ++i) p[i] = values[i];
    return p;
}

template <typename T>
void describe(TableDesc& desc, const CtColumn& c) {
    if (c.ndim < 0) {
        desc.addColumn(ScalarColumnDesc<T>(c.name, c.comment));
    } else if (c.n_shape > 0) {
        desc.addColumn(ArrayColumnDesc<T>(c.name, c.comment, position(c.shape, c.n_shape), ColumnDesc::FixedShape));
    } else {
        desc.addColumn(ArrayColumnDesc<T>(c.name, c.comment, c.ndim == 0 ? -1 : c.ndim));
    }
}

void describe(TableDesc& desc, const CtColumn& c) {
    switch (c.type) {
        case CT_BOOL: return describe<Bool>(desc, c);
        case CT_INT: return describe<Int>(desc, c);
        case CT_FLOAT: return describe<Float>(desc, c);
        case CT_DOUBLE: return describe<Double>(desc, c);
        case CT_COMPLEX: return describe<Complex>(desc, c);
        case CT_STRING: return describe<String>(desc, c);
        default: throw AipsError("unknown column type");
    }
}

Slicer rows_from(uint64_t start, uint64_t rows) { return Slicer(IPosition(1, start), IPosition(1, rows)); }

template <typename T>
void put(Table& t, const char* column, uint64_t start, uint64_t rows, const IPosition& cell, const void* data) {
    // casacore's interface is not const-correct for shared storage; the values are only read.
    T* values = static_cast<T*>(const_cast<void*>(data));
    if (cell.empty()) {
        ScalarColumn<T>(t, column).putColumnRange(rows_from(start, rows), Vector<T>(IPosition(1, rows), values, SHARE));
        return;
    }
    ArrayColumn<T> c(t, column);
    if (!c.columnDesc().isFixedShape()) {
        // Some storage managers refuse to set the shape of a cell again.
        for (uint64_t r = start; r < start + rows; ++r) {
            if (!c.isDefined(r) || !c.shape(r).isEqual(cell)) c.setShape(r, cell);
        }
    }
    c.putColumnRange(rows_from(start, rows), Array<T>(cell.concatenate(IPosition(1, rows)), values, SHARE));
}

template <typename T>
void get(const Table& t, const char* column, uint64_t start, uint64_t rows, const IPosition& cell, void* data) {
    T* values = static_cast<T*>(data);
    if (cell.empty()) {
        Vector<T> v(IPosition(1, rows), values, SHARE);
        ScalarColumn<T>(t, column).getColumnRange(rows_from(start, rows), v, False);
        return;
    }
    ArrayColumn<T> c(t, column);
    // casacore copies cells of any shape into the room of the first one.
    for (uint64_t r = start; !c.columnDesc().isFixedShape() && r < start + rows; ++r) {
        const bool same = c.isDefined(r) && c.shape(r).isEqual(cell);
        if (!same) throw AipsError("row " + String::toString(r) + ": expected a cell of shape " + cell.toString() + ", found another one");
    }
    Array<T> a(cell.concatenate(IPosition(1, rows)), values, SHARE);
    c.getColumnRange(rows_from(start, rows), a, False);
}

int32_t type_code(DataType type) {
    switch (type) {
        case TpBool: return CT_BOOL;
        case TpInt: return CT_INT;
        case TpFloat: return CT_FLOAT;
        case TpDouble: return CT_DOUBLE;
        case TpComplex: return CT_COMPLEX;
        case TpString: return CT_STRING;
        default: return -1;
    }
}

void (*end_process)(const char* what) = nullptr;

// Tell what the exception says that ends the process.
[[noreturn]] void terminate() {
    std::string what = "an unknown exception";
    try {
        if (std::current_exception()) throw;
    } catch (const std::exception& e) {
        what = e.what();
    } catch (...) {
    }
    if (end_process) end_process(what.c_str());
    std::abort();
}

}  // namespace

extern "C" {

void ct_on_terminate(void (*end)(const char* what)) {
    end_process = end;
    std::set_terminate(terminate);
}

const char* ct_error() { return ct::last_error().c_str(); }

int ct_create(const char* path, CtTable** out) {
    return guard([&] {
        SetupNewTable setup(path, TableDesc("", TableDesc::Scratch), Table::New);
        *out = new CtTable{Table(setup, no_lock(), 0)};
    });
}

int ct_open(const char* path, int32_t change, CtTable** out) {
    return guard([&] {
        // A table that others have written keeps its number of rows in its lock file, which casacore brings up to date only under a lock.
        // The table that is changed is a copy that nobody else knows, so that nobody waits for the lock.
        if (change) {
            *out = new CtTable{Table(path, TableLock(TableLock::PermanentLocking), Table::Update)};
        } else {
            *out = new CtTable{Table(path, no_lock(), Table::Old)};
        }
    });
}

int ct_free_bytes(const char* path, uint64_t* bytes) {
    return guard([&] { *bytes = std::filesystem::space(path).available; });
}

int ct_flush(CtTable* t) {
    return guard([&] { t->table.flush(True); });
}

void ct_close(CtTable* t, int32_t discard) {
    guard([&] {
        if (discard) t->table.markForDelete();
    });
    guard([&] { delete t; });
}

int ct_set_info(CtTable* t, const char* type, const char* readme) {
    return guard([&] {
        TableInfo& info = t->table.tableInfo();
        info.setType(type);
        info.readmeAddLine(readme);
    });
}

int ct_add_columns(CtTable* t, const CtColumn* columns, size_t n, int32_t manager, const char* manager_name, const int64_t* tile,
                   size_t n_tile) {
    return guard([&] {
        TableDesc desc("", TableDesc::Scratch);
        for (size_t i = 0; i < n; ++i) describe(desc, columns[i]);
        std::unique_ptr<DataManager> store;
        if (manager == CT_STANDARD) {
            store.reset(new StandardStMan(manager_name, 32768));
        } else if (manager == CT_INCREMENTAL) {
            store.reset(new IncrementalStMan(manager_name, 32768));
        } else {
            Vector<String> names(n);
            for (size_t i = 0; i < n; ++i) names[i] = columns[i].name;
            desc.defineHypercolumn(manager_name, n_tile, names);
            const IPosition shape = position(tile, n_tile);
            if (manager == CT_TILED_SHAPE) {
                store.reset(new TiledShapeStMan(manager_name, shape));
            } else {
                store.reset(new TiledColumnStMan(manager_name, shape));
            }
        }
        t->table.addColumn(desc, *store);
    });
}

int ct_add_rows(CtTable* t, uint64_t n) {
    return guard([&] { t->table.addRow(n); });
}

uint64_t ct_n_rows(const CtTable* t) { return t->table.nrow(); }

int ct_column_info(const CtTable* t, const char* column, int32_t* type, int32_t* ndim) {
    return guard([&] {
        *type = -1;
        *ndim = -1;
        if (!t->table.tableDesc().isColumn(column)) return;
        const ColumnDesc& desc = t->table.tableDesc().columnDesc(column);
        *type = type_code(desc.dataType());
        *ndim = desc.isScalar() ? -1 : desc.ndim() < 0 ? 0 : desc.ndim();
    });
}

int ct_cell_shape(const CtTable* t, const char* column, uint64_t row, int64_t* shape, int32_t* n) {
    return guard([&] {
        TableColumn c(t->table, column);
        if (!c.isDefined(row)) {
            *n = -1;
            return;
        }
        const IPosition p = c.columnDesc().isScalar() ? IPosition() : c.shape(row);
        if (p.size() > 8) throw AipsError("a cell with more than 8 axes");
        *n = p.size();
        for (size_t i = 0; i < p.size(); ++i) shape[i] = p[i];
    });
}

int ct_put(CtTable* t, const char* column, int32_t type, uint64_t start, uint64_t rows, const int64_t* shape, size_t n_shape,
           const void* data) {
    return guard([&] {
        const IPosition cell = position(shape, n_shape);
        switch (type) {
            case CT_BOOL: return put<Bool>(t->table, column, start, rows, cell, data);
            case CT_INT: return put<Int>(t->table, column, start, rows, cell, data);
            case CT_FLOAT: return put<Float>(t->table, column, start, rows, cell, data);
            case CT_DOUBLE: return put<Double>(t->table, column, start, rows, cell, data);
            case CT_COMPLEX: return put<Complex>(t->table, column, start, rows, cell, data);
            default: throw AipsError("unknown element type");
        }
    });
}

int ct_get(const CtTable* t, const char* column, int32_t type, uint64_t start, uint64_t rows, const int64_t* shape, size_t n_shape,
           void* data) {
    return guard([&] {
        const IPosition cell = position(shape, n_shape);
        switch (type) {
            case CT_BOOL: return get<Bool>(t->table, column, start, rows, cell, data);
            case CT_INT: return get<Int>(t->table, column, start, rows, cell, data);
            case CT_FLOAT: return get<Float>(t->table, column, start, rows, cell, data);
            case CT_DOUBLE: return get<Double>(t->table, column, start, rows, cell, data);
            case CT_COMPLEX: return get<Complex>(t->table, column, start, rows, cell, data);
            default: throw AipsError("unknown element type");
        }
    });
}

int ct_put_strings(CtTable* t, const char* column, uint64_t row, int32_t n, const char* const* values) {
    return guard([&] {
        if (n < 0) {
            ScalarColumn<String>(t->table, column).put(row, String(values[0]));
            return;
        }
        Vector<String> v(n);
        for (int32_t i = 0; i < n; ++i) v[i] = values[i];
        ArrayColumn<String>(t->table, column).put(row, v);
    });
}

int ct_get_string(const CtTable* t, const char* column, uint64_t row, size_t index, const char** value) {
    return guard([&] {
        ct::last_text().clear();
        if (TableColumn(t->table, column).columnDesc().isScalar()) {
            ct::last_text() = ScalarColumn<String>(t->table, column)(row);
        } else {
            ArrayColumn<String> c(t->table, column);
            if (!c.isDefined(row)) throw AipsError("the cell is empty");
            const Array<String> a = c(row);
            if (index >= a.nelements()) throw AipsError("the cell has fewer elements");
            ct::last_text() = a.tovector()[index];
        }
        *value = ct::last_text().c_str();
    });
}
}
