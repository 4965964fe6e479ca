// Each line marked WRONG has a fault that check_types.cjs must find, and no other line has one.
import {compare, fits} from '../../../web/src/regression/rows.js';
import {toHash} from '../../../web/src/regression/address.js';
import {indexAt} from '../../../web/src/report/numbers.js';
import {zoomed} from '../../../web/src/report/scales.js';
import {element} from '../../../web/src/report/dom.js';

indexAt([0, 1], 0.5);
indexAt([0, 1], '0.5');  // WRONG: a text for a time
fits({text: '', kind: 'bad'}, [], '');  // WRONG: mustFail is missing
toHash({find: '', show: '', key: 'error', upwards: true});  // WRONG: no such member
compare(1, 2);  // WRONG: too few arguments
zoomed([0, 1], 0.5, 0, {start: 0, end: 1, sample: 0.1})[2];  // WRONG: a range has two ends
element('span', {}).value;  // WRONG: only inputs have a value
export const twice = (x) => 2 * x;  // WRONG: a parameter of no type
