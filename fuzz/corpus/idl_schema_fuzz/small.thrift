enum E { A = 1, B }
typedef list<map<i32, S>> T
const map<string, list<i32>> k = {"a": [1, 2]}
struct S { 1: optional S s, 2: E e = E.A; 3: set<double> d }
union U { 1: i32 a, 2: S s }
exception X { 1: U u }
service B { void p() }
service C extends B { oneway void q(1: T t), S r(1: U u) throws (1: X x) }
