//! Cycles of a graph.

/// The groups of more than one node in which every node leads to every other, each ascending.
pub fn find_cycles(nodes: usize, edges: &[(usize, usize)]) -> Vec<Vec<usize>> {
    let mut next = vec![Vec::new(); nodes];
    edges.iter().for_each(|&(from, to)| next[from].push(to));
    let reached: Vec<Vec<bool>> = (0..nodes).map(|start| reached_from(start, &next)).collect();
    let mut found = Vec::new();
    let mut taken = vec![false; nodes];
    for a in 0..nodes {
        let cycle: Vec<usize> =
            (a..nodes).filter(|&b| !taken[b] && (a == b || (reached[a][b] && reached[b][a]))).collect();
        if !taken[a] && cycle.len() > 1 {
            cycle.iter().for_each(|&node| taken[node] = true);
            found.push(cycle);
        }
    }
    found
}

fn reached_from(start: usize, next: &[Vec<usize>]) -> Vec<bool> {
    let mut reached = vec![false; next.len()];
    let mut open = vec![start];
    while let Some(node) = open.pop() {
        for &to in &next[node] {
            if !reached[to] {
                reached[to] = true;
                open.push(to);
            }
        }
    }
    reached
}

#[test]
fn a_cycle_is_found_and_a_chain_has_none() {
    let edges = [(0, 1), (1, 2), (2, 3), (3, 1), (3, 4), (5, 6), (6, 5)];
    assert_eq!(find_cycles(7, &edges), [vec![1, 2, 3], vec![5, 6]]);
    assert_eq!(find_cycles(4, &[(0, 1), (1, 2), (0, 2), (2, 3), (1, 1)]), Vec::<Vec<usize>>::new());
}
