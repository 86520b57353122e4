// The header compiles in every dialect, twice included, and fits the library.

#include "raykern.h"
#include "raykern.h"

#include <string.h>

int main(void) {
    if (rt_version() != RT_RAYKERN_VERSION || RT_NONE != 4294967295u) return 1;
    if (RT_OK != 0 || RT_ERROR_INTERNAL != 16 || RT_ERROR_CANCELLED != 17) return 2;
    if (RT_QUALITY_BEST != 2 || RT_LAYOUT_WIDE_16 != 16) return 2;
    if (RT_PLAIN_LIST_ALWAYS != 2 || RT_PRECISION_WATERTIGHT != 1 || RT_FACING_BACK != 2) return 3;
    if (sizeof(RtStatus) != 4 || sizeof(bool) != 1) return 4;
    for (RtStatus a = RT_OK; a <= RT_ERROR_CANCELLED + 1; a++) {
        if (strlen(rt_status_message(a)) == 0) return 5;
        for (RtStatus b = RT_OK; b < a; b++)
            if (strcmp(rt_status_message(a), rt_status_message(b)) == 0) return 6;
    }
    return strcmp(rt_status_message(-1), rt_status_message(99)) != 0;
}
