// Keywords of tables and columns: units, measures, links to subtables.
#include "handle.h"

#include <casacore/casa/Arrays/Vector.h>
#include <casacore/tables/Tables/TableColumn.h>
#include <casacore/tables/Tables/TableRecord.h>

using namespace casacore;

namespace {

template <typename T, typename U>
void define(TableRecord& record, const char* key, int32_t n, const U* values) {
    if (n < 0) {
        record.define(key, T(values[0]));
        return;
    }
    Vector<T> v(n);
    for (int32_t i = 0; i < n; ++i) v[i] = T(values[i]);
    record.define(key, v);
}

void define(TableRecord& record, const char* key, int32_t type, int32_t n, const void* values) {
    switch (type) {
        case CT_BOOL: return define<Bool>(record, key, n, static_cast<const bool*>(values));
        case CT_INT: return define<Int>(record, key, n, static_cast<const int32_t*>(values));
        case CT_FLOAT: return define<Float>(record, key, n, static_cast<const float*>(values));
        case CT_DOUBLE: return define<Double>(record, key, n, static_cast<const double*>(values));
        case CT_STRING: return define<String>(record, key, n, static_cast<const char* const*>(values));
        default: throw AipsError("unknown keyword type");
    }
}

// One element of a field, as a number or as a text.
bool element(const TableRecord& record, const String& key, size_t index, double* number, std::string& text) {
    const Int field = record.fieldNumber(key);
    if (field < 0) return false;
    switch (record.dataType(field)) {
        case TpBool: *number = record.asBool(field); return index == 0;
        case TpShort:
        case TpInt:
        case TpUInt:
        case TpInt64: *number = record.asInt64(field); return index == 0;
        case TpFloat:
        case TpDouble: *number = record.asDouble(field); return index == 0;
        case TpString: text = record.asString(field); return index == 0;
        case TpArrayInt:
        case TpArrayUInt:
        case TpArrayFloat:
        case TpArrayDouble: {
            const Array<Double> a = record.toArrayDouble(field);
            if (index >= a.nelements()) return false;
            *number = a.tovector()[index];
            return true;
        }
        case TpArrayString: {
            const Array<String> a = record.asArrayString(field);
            if (index >= a.nelements()) return false;
            text = a.tovector()[index];
            return true;
        }
        default: return false;
    }
}

char letter(DataType type) {
    switch (type) {
        case TpBool: return 'b';
        case TpShort:
        case TpInt:
        case TpUInt:
        case TpInt64: return 'i';
        case TpFloat:
        case TpDouble: return 'f';
        case TpString: return 's';
        case TpTable: return 't';
        case TpRecord: return 'r';
        default: return 'o';
    }
}

}  // namespace

extern "C" {

int ct_put_keyword(CtTable* t, const char* column, const char* group, const char* key, int32_t type, int32_t n, const void* values) {
    return guard([&] {
        TableColumn c;
        if (column) c = TableColumn(t->table, column);
        TableRecord& top = column ? c.rwKeywordSet() : t->table.rwKeywordSet();
        if (!group) return define(top, key, type, n, values);
        if (!top.isDefined(group)) top.defineRecord(group, TableRecord());
        define(top.rwSubRecord(group), key, type, n, values);
    });
}

int ct_names(const CtTable* t, const char* group, int32_t keywords, const char** text) {
    return guard([&] {
        std::string& lines = ct::last_text();
        lines.clear();
        if (!keywords) {
            for (const String& name : t->table.tableDesc().columnNames().tovector()) {
                lines += "c ";
                lines += name;
                lines += '\n';
            }
        } else {
            const TableRecord& top = t->table.keywordSet();
            const bool found = !group || (top.isDefined(group) && top.dataType(group) == TpRecord);
            const TableRecord none;
            const TableRecord& record = !found ? none : group ? top.subRecord(group) : top;
            for (uInt k = 0; k < record.nfields(); ++k) {
                lines += letter(record.dataType(k));
                lines += ' ';
                lines += record.name(k);
                lines += '\n';
            }
        }
        *text = lines.c_str();
    });
}

int ct_put_table_keyword(CtTable* t, const char* key, const CtTable* subtable) {
    return guard([&] { t->table.rwKeywordSet().defineTable(key, subtable->table); });
}

int ct_get_keyword(const CtTable* t, const char* column, const char* group, const char* key, size_t index, int32_t* found,
                   double* number, const char** text) {
    return guard([&] {
        *found = 0;
        *number = 0;
        ct::last_text().clear();
        *text = ct::last_text().c_str();
        TableColumn c;
        if (column) {
            if (!t->table.tableDesc().isColumn(column)) return;
            c = TableColumn(t->table, column);
        }
        const TableRecord& top = column ? c.keywordSet() : t->table.keywordSet();
        if (group && !(top.isDefined(group) && top.dataType(group) == TpRecord)) return;
        *found = element(group ? top.subRecord(group) : top, key, index, number, ct::last_text());
        *text = ct::last_text().c_str();
    });
}
}
