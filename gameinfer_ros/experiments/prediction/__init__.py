"""The study of prediction: does it help to infer which equilibrium is played?"""
