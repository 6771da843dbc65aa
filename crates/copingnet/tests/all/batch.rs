//! The learned guess is the same as in training.

use crate::moving::{KINDS, Prepared, apart, in_motion, prepared};
use burn::tensor::Tensor;
use copingnet::{Backend, GraphTensors, Inputs, Network};
use graph::Batch;
use kernels::Spatial;

#[test]
fn a_batch_in_burn_gives_what_guesses_give_one_by_one() {
    for kind in KINDS {
        let mut all: Vec<Prepared> = (0..4)
            .map(|which| {
                let (model, state) = in_motion(which);
                prepared(kind, &model, &state)
            })
            .collect();
        let (mut graphs, mut nodes, mut edges) = (Batch::default(), Vec::new(), Vec::new());
        for one in &mut all {
            let mut inputs = Inputs::default();
            one.encoder.encode(&one.component, &mut inputs);
            let (n, m) = (one.component.poses.len(), one.component.dlambda.len());
            graphs.push(one.encoder.graph());
            nodes.extend(crate::common::rows(&inputs.nodes, &inputs.constant_nodes, n));
            edges.extend(crate::common::rows(&inputs.edges, &inputs.constant_edges, m));
        }
        let device = &Backend::Ndarray.device();
        let tensors = GraphTensors::new(&graphs, &nodes, &edges, true, device);
        let (nodes, edges) = Network::new(&all[0].weights, device).forward(&tensors);
        let [nodes, edges] =
            [nodes, edges.unwrap()].map(|x: Tensor<2>| x.into_data().iter::<f32>().collect::<Vec<_>>());
        let (mut node, mut edge) = (0, 0);
        for (which, one) in all.iter_mut().enumerate() {
            let expected = one.predicted();
            let [n, m] = one.outputs(kind.1);
            let mut found = vec![Spatial::zero(); expected.len()];
            let own = [&nodes[node..node + n], &edges[edge..edge + m]];
            one.encoder.dlambda(&one.component, own, &mut found);
            (node, edge) = (node + n, edge + m);
            let errors = apart(&found, &expected);
            assert!(errors.iter().all(|&error| error < 1e-5), "{kind:?} {which}: {errors:?}");
        }
        assert_eq!([node, edge], [nodes.len(), edges.len()]);
    }
}
